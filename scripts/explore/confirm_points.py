"""Compare the tapes of `direct` with those of the full DEM, at the recipes that were chosen beforehand.

In: the quantities of both tapes of each recipe (CSV, of measure_microstructure), and tables/explore_noise.csv.
Out: a table (CSV): slurry, property, unit, direct, dem, difference (direct - dem), band and within_band. The band is
the half width of the 95 % interval of the difference of two slurries of one recipe, from the standard deviation between
replicas: t x sqrt(2) x sd. It is empty where there are no replicas.
"""

import numpy as np

from slurrycast.data.tables import read_table, write_table
from slurrycast.runtime.command_line import Namespace, Parser, run_main

LEVEL = 0.95


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--slurries", "ids of the recipes", nargs="+")
    parser.add_input("--direct", "quantities of the tapes of direct (CSV), in this order", nargs="+")
    parser.add_input("--dem", "quantities of the tapes of the DEM (CSV), in this order", nargs="+")
    parser.as_many_of_each("slurries", "direct", "dem")
    parser.add_tables("explore_noise")
    parser.add_output("--table", "comparison (CSV)")


def band(sd: float, freedom: int) -> float:
    """Half width of the interval of `LEVEL` of the difference of two slurries; NaN without replicas."""
    from scipy.stats import t

    return float(t.ppf((1 + LEVEL) / 2, freedom) * np.sqrt(2) * sd) if freedom else np.nan


def main(args: Namespace) -> None:
    """Compare and write."""
    noise, rows = read_table(args.explore_noise), []
    for slurry, *paths in zip(args.slurries, args.direct, args.dem, strict=True):
        direct, dem = (read_table(path).set_index("quantity").value for path in paths)
        for of_it in noise.itertuples():
            difference, width = direct[of_it.property] - dem[of_it.property], band(of_it.replica_sd, of_it.freedom)
            within = "" if np.isnan([difference, width]).any() else "yes" if abs(difference) <= width else "no"
            values = {"direct": direct[of_it.property], "dem": dem[of_it.property], "difference": difference}
            names = {"slurry": slurry, "property": of_it.property, "unit": of_it.unit}
            rows.append(names | values | {"band": width, "within_band": within})
    write_table(args.table, rows)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
