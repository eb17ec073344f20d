"""Compare the radial distribution functions of relaxed structures with those of the DEM's target structures.

In: the curves (CSV) of any number of surrogates and slurries, all with a target.
Out: a table (CSV) of one row for each of them and pair of phases: end of the range r_max_um, number of bins, and the
mean over the bins of |g_dem - g_relaxed|, dimensionless.
"""

from pathlib import Path

from slurrycast.analysis.rdf import mean_absolute_difference
from slurrycast.data.tables import read_table, write_table
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import InputError

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


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--rdf", "curves of slurries with a target (CSV), none where all are new", nargs="*")
    parser.add_output("--table", "table of differences (CSV)")
    parser.add_output("--cost", "cost record (JSON)")


def main(args: Namespace) -> None:
    """Compare the curves of every file and write the table."""
    with measured_cost(args.cost, "compare_rdf"):
        rows = [row for path in args.rdf for row in difference_rows(path)]
        write_table(args.table, rows, columns=COLUMNS)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
