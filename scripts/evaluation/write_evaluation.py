"""Write evaluation.html: what the surrogates of a run are worth, in one file that opens without a network.

In: the tables of the evaluation, tables/equilibrium.csv for the roles of the slurries, and figures, known by their file
names: skill, structure, front, relaxation, uncertainty.
Out: evaluation.html with embedded images. Units are those of the tables' column names.
"""

import json

from slurrycast.data.tables import read_equilibrium, read_table
from slurrycast.report.evaluation_results import Evaluation
from slurrycast.report.sections import evaluation_html
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import write_text


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--run", "name of the run, for the title")
    parser.add_value("--networks", "labels to hold against affine and early_dem", nargs="*", default=[])
    parser.add_value("--density-tolerance", "largest density error, as a share of the DEM's", type=float)
    parser.add_value("--rdf-tolerance", "largest RDF difference, in replica spreads", type=float)
    parser.add_value("--relaxed-for", "JSON: steps of relaxation by label", type=json.loads)
    parser.add_tables(
        "equilibrium", "skill", "noise", "structure_errors", "front", "equal_cost", "cost_scaling", "article_costs"
    )
    parser.add_input("--ablation", "tables/ablation.csv, where the run has one", required=False)
    parser.add_input("--relaxation", "tables/relaxation.csv, where the run has one", required=False)
    parser.add_input("--uncertainty", "tables/uncertainty.csv, where a surrogate has a spread", required=False)
    parser.add_input("--figures", "figures (PNG)", nargs="+")
    parser.add_output("--page", "evaluation.html")


def main(args: Namespace) -> None:
    """Read everything and write the page."""
    equilibrium = read_equilibrium(args.equilibrium)
    tables = ("skill", "noise", "structure_errors", "front", "equal_cost", "cost_scaling", "article_costs")
    evaluation = Evaluation(
        run=args.run,
        roles=dict(zip(equilibrium.slurry, equilibrium.role, strict=True)),
        networks=args.networks,
        density_tolerance=args.density_tolerance,
        rdf_tolerance=args.rdf_tolerance,
        relaxed_for=args.relaxed_for,
        **{name: read_table(getattr(args, name)) for name in tables},
        ablation=read_table(args.ablation) if args.ablation else None,
        relaxation=read_table(args.relaxation) if args.relaxation else None,
        uncertainty=read_table(args.uncertainty) if args.uncertainty else None,
        figures={path.stem: path for path in args.figures},
    )
    write_text(args.page, evaluation_html(evaluation))


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
