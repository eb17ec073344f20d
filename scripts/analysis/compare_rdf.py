"""Compare the radial distribution functions of relaxed structures with those of the DEM's target structures.

In: the curves (CSV) of any number of surrogates and slurries, all with a target.
Out: a table (CSV) of one row for each of them and pair of phases: end of the range r_max_um, number of bins, and the
mean over the bins of |g_dem - g_relaxed|, dimensionless.
"""

import argparse
from pathlib import Path

import pandas as pd

from slurrycast.analysis.rdf import mean_absolute_difference
from slurrycast.data.tables import read_table
from slurrycast.runtime.command_line import Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import InputError, write_text

COLUMNS = ("surrogate", "slurry", "pair", "r_max_um", "bins", "mean_abs_difference")


def difference_rows(path: Path) -> list[dict]:
    """Rows of the table for the curves of one slurry; InputError if they have no target."""
    curves = read_table(path)
    if curves["g_dem"].isna().any():
        raise InputError(f"{path}: g_dem is empty, only slurries with a target can be compared")
    return [
        {
            "surrogate": surrogate,
            "slurry": slurry,
            "pair": pair,
            # r_um are centres of equal bins that start at 0.
            "r_max_um": curve["r_um"].iloc[-1] + curve["r_um"].iloc[0],
            "bins": len(curve),
            "mean_abs_difference": mean_absolute_difference(curve["g_dem"], curve["g_relaxed"]),
        }
        for (surrogate, slurry, pair), curve in curves.groupby(["surrogate", "slurry", "pair"], sort=False)
    ]


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_input("--rdf", "curves of slurries with a target (CSV), none where all are new", nargs="*")
    parser.add_output("--table", "table of differences (CSV)")
    parser.add_output("--cost", "cost record (JSON)")
    return parser.parse_args()


def main() -> None:
    """Compare the curves of every file and write the table."""
    args = parse_args()
    with measured_cost(args.cost, "compare_rdf"):
        rows = [row for path in args.rdf for row in difference_rows(path)]
        write_text(args.table, pd.DataFrame(rows, columns=COLUMNS).to_csv(index=False, float_format="%.9g"))


if __name__ == "__main__":
    run_main(main)
