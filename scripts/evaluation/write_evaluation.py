"""Write evaluation.html: what the surrogates of a run are worth, in one file that opens without a network.

In: the tables of the evaluation, tables/equilibrium.csv for the roles of the slurries, and figures, known by their file
names: skill, structure, front, relaxation, uncertainty.
Out: evaluation.html with embedded images. Units are those of the tables' column names.
"""

import argparse
import json
from pathlib import Path

from slurrycast.data.tables import read_equilibrium, read_table
from slurrycast.report.evaluation_report import Evaluation, evaluation_html
from slurrycast.runtime.command_line import Parser, input_file, run_main
from slurrycast.runtime.files import write_text


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument("--run", required=True, help="name of the run, for the title")
    parser.add_argument("--networks", nargs="*", default=[], help="labels to hold against affine and early_dem")
    parser.add_argument(
        "--density-tolerance", type=float, required=True, help="largest density error, as a share of the DEM's"
    )
    parser.add_argument("--rdf-tolerance", type=float, required=True, help="largest RDF difference, in replica spreads")
    parser.add_argument("--relaxed-for", required=True, type=json.loads, help="JSON: steps of relaxation by label")
    parser.add_argument("--equilibrium", type=input_file, required=True, help="in: tables/equilibrium.csv")
    parser.add_argument("--skill", type=input_file, required=True, help="in: tables/skill.csv")
    parser.add_argument("--noise", type=input_file, required=True, help="in: tables/noise.csv")
    parser.add_argument("--structure-errors", type=input_file, required=True, help="in: tables/structure_errors.csv")
    parser.add_argument("--front", type=input_file, required=True, help="in: tables/front.csv")
    parser.add_argument("--equal-cost", type=input_file, required=True, help="in: tables/equal_cost.csv")
    parser.add_argument("--cost-scaling", type=input_file, required=True, help="in: tables/cost_scaling.csv")
    parser.add_argument("--article-costs", type=input_file, required=True, help="in: tables/article_costs.csv")
    parser.add_argument("--ablation", type=input_file, help="in: tables/ablation.csv, where the run has one")
    parser.add_argument("--relaxation", type=input_file, help="in: tables/relaxation.csv, where the run has one")
    parser.add_argument(
        "--uncertainty", type=input_file, help="in: tables/uncertainty.csv, where a surrogate has a spread"
    )
    parser.add_argument("--figures", type=input_file, nargs="+", required=True, help="in: figures (PNG)")
    parser.add_argument("--page", type=Path, required=True, help="out: evaluation.html")
    return parser.parse_args()


def main() -> None:
    """Read everything and write the page."""
    args = parse_args()
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
    run_main(main)
