"""Judge whether the tapes of each surrogate are inside the noise of those of the DEM.

In: tables/tape_errors.csv, and the slurries to judge on.
Out: tables/tape_verdicts.csv, with the columns of tables/verdicts.csv (judge_structures.py), a row for each surrogate
and judged quantity that has a scatter.
"""

from slurrycast.data.tables import read_table, write_table
from slurrycast.evaluation.verdicts import COLUMNS, judge, judged_tape_rows
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("tape_errors")
    parser.add_value("--slurries", "slurries to judge on", nargs="*", default=[])
    parser.add_output("--table", "table of verdicts (CSV)")


def main(args: Namespace) -> None:
    """Judge and write the table."""
    write_table(args.table, judge(judged_tape_rows(read_table(args.tape_errors), args.slurries)), columns=COLUMNS)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
