"""Write evaluation.html: what the surrogates of a run are worth, in one file that opens without a network.

In: the tables of the evaluation, tables/equilibrium.csv for the roles of the slurries, and figures, known by their file
names: slurry_<surrogate>_<slurry>, verdicts, tape_verdicts, skill, front, relaxation, uncertainty.
Out: evaluation.html with embedded images. Units are those of the tables' column names.
"""

from slurrycast.data.tables import read_equilibrium, read_table
from slurrycast.report.evaluation_results import Evaluation
from slurrycast.report.sections import evaluation_html
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import write_text

TABLES = ("skill", "noise", "structure_errors", "verdicts", "front", "equal_cost", "cost_scaling", "article_costs")
OPTIONAL_TABLES = ("ablation", "relaxation", "uncertainty", "tape_errors", "tape_verdicts")


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--run", "name of the run, for the title")
    parser.add_value("--networks", "labels to hold against affine and early_dem", nargs="*", default=[])
    parser.add_tables("equilibrium", *TABLES)
    for name in OPTIONAL_TABLES:
        parser.add_input(f"--{name.replace('_', '-')}", f"tables/{name}.csv, where the run has one", required=False)
    parser.add_input("--figures", "figures (PNG)", nargs="+")
    parser.add_output("--page", "evaluation.html")


def main(args: Namespace) -> None:
    """Read everything and write the page."""
    equilibrium = read_equilibrium(args.equilibrium)
    evaluation = Evaluation(
        run=args.run,
        roles=dict(zip(equilibrium.slurry, equilibrium.role, strict=True)),
        networks=args.networks,
        **{name: read_table(getattr(args, name)) for name in TABLES},
        **{name: read_table(path) if (path := getattr(args, name)) else None for name in OPTIONAL_TABLES},
        figures={path.stem: path for path in args.figures},
    )
    write_text(args.page, evaluation_html(evaluation))


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
