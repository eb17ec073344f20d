"""Compare each surrogate with the DEM itself, continued from an input frame with a faster barostat, at equal cost.

In: tables/front.csv and tables/skill.csv.
Out: a table (CSV) of one row for each slurry and surrogate that is not early_dem: cost_share_of_full_dem, error of the
predicted coordinates (um2), density and RDF error after relaxation, each beside that of early_dem at the same cost, end
to end (early_dem_cost_share). All early_dem of the slurry, with every barostat and from every input frame, form one
curve of error against cost: it has the errors of the one with the lowest MSE that costs no more, and is linear in the
logarithm of cost in between. Beyond its ends, the errors are those at the nearer end, early_dem_cost_share is the cost
there, and a note says on which side.
"""

from slurrycast.data.tables import read_table, write_table
from slurrycast.evaluation.front import at_equal_cost
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("front", "skill")
    parser.add_output("--table", "table (CSV)")


def main(args: Namespace) -> None:
    """Read, compare, write."""
    table = at_equal_cost(read_table(args.front), read_table(args.skill))
    write_table(args.table, table, digits=6)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
