"""Write explore.html: what the tapes of many recipes are like, in one file that opens without a network.

In: the tables of the exploration, and the figures explore_maps and explore_fits.
Out: explore.html with embedded images. Units are those of the tables' column names.
"""

from slurrycast.data.tables import read_table
from slurrycast.report.explore_statistics import Exploration
from slurrycast.report.sections import explore_html
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import write_text

TABLES = ("noise", "models", "indices", "nearest", "costs")


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--run", "name of the run, for the title")
    parser.add_tables("explore", *(f"explore_{name}" for name in TABLES))
    parser.add_input("--explore-confirmation", "tables/explore_confirmation.csv, where there is one", required=False)
    parser.add_input("--figures", "figures (PNG)", nargs="+")
    parser.add_output("--page", "explore.html")


def main(args: Namespace) -> None:
    """Read everything and write the page."""
    confirmation = args.explore_confirmation
    exploration = Exploration(
        run=args.run,
        table=read_table(args.explore),
        **{name: read_table(getattr(args, f"explore_{name}")) for name in TABLES},
        confirmation=read_table(confirmation) if confirmation else None,
        figures={path.stem: path for path in args.figures},
    )
    write_text(args.page, explore_html(exploration))


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
