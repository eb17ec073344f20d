"""Judge whether the relaxed structures of each surrogate are inside the noise of the DEM.

In: tables/structure_errors.csv, and the slurries to judge on.
Out: tables/verdicts.csv, a row for each surrogate and judged measure: the number of slurries; of the difference from
the DEM in replica sd, mean_in_sd and the ends of its interval of 90 %, lower_in_sd and upper_in_sd; p of the t test
that it is zero, and p_holm, corrected over the measures of the surrogate; and verdict: equivalent, differs or not
resolved, or empty for less than three slurries. `slurrycast.evaluation.verdicts` has the definitions.
"""

from slurrycast.data.tables import read_table, write_table
from slurrycast.evaluation.verdicts import COLUMNS, judge, judged_rows
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("structure_errors")
    parser.add_value("--slurries", "slurries to judge on", nargs="*", default=[])
    parser.add_output("--table", "table of verdicts (CSV)")


def main(args: Namespace) -> None:
    """Judge and write the table."""
    write_table(args.table, judge(judged_rows(read_table(args.structure_errors), args.slurries)), columns=COLUMNS)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
