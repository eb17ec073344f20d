"""Write report.html: all tables and figures of a run in one file that opens without a network.

In: the effective configuration, versions, tables, inputs.json of every slurry and run.json of those that have a DEM,
model and learning curves of each surrogate that is a Keras model; figures, known by their file names: workflow,
densification, learning_curves_<surrogate>, density, rdf, costs, coordinates_<slurry>, slurry_<surrogate>_<slurry>.
Out: report.html with embedded images. Units are those of the tables' column names.
"""

import json

import yaml

from slurrycast import surrogates
from slurrycast.config.formulations import wet_recipes
from slurrycast.data.tables import read_equilibrium, read_table
from slurrycast.evaluation.speedup import read_by_slurry
from slurrycast.report.network_table import read_network
from slurrycast.report.results import Results
from slurrycast.report.sections import report_html
from slurrycast.runtime.command_line import Namespace, Parser, named_file, run_main
from slurrycast.runtime.files import write_text


def described(label: str) -> tuple[str, str]:
    """What the surrogate `label` looks at, and its rule for the final box, in words."""
    surrogate = surrogates.parse(label).surrogate
    return surrogate.looks_at, surrogate.box_rule.name.replace("_", " ")


OPTIONAL_TABLES = dict.fromkeys(("microstructure", "drying_ends", "drying_calibration"), "where nothing is dried")
OPTIONAL_TABLES["training_range"] = "without training slurries"


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--config", "config.yaml of the run")
    parser.add_input("--versions", "versions.json of the run")
    parser.add_input("--inputs", "inputs.json of every slurry", nargs="+")
    parser.add_input("--run-json", "run.json of every slurry that has a DEM", nargs="*")
    parser.add_value("--roles", "JSON: role of every slurry by its id, in the order of the table", type=json.loads)
    parser.add_value("--expected-g-cm3", "JSON: expected density of every slurry in equilibrium", type=json.loads)
    parser.add_value("--formulations", 'JSON: name of the recipe of every slurry, "" of the default', type=json.loads)
    parser.add_input("--density", "tables/density_volume.csv")
    parser.add_tables("coordinate_errors", "rdf_errors", "equilibrium", "relaxation_ends")
    for name, missing in OPTIONAL_TABLES.items():
        parser.add_input(f"--{name.replace('_', '-')}", f"tables/{name}.csv; none {missing}", required=False)
    parser.add_input("--cost-table", "tables/cost.csv")
    parser.add_tables("speedup")
    parser.add_value("--surrogates", "labels, in the order of columns", nargs="+")
    parser.add_value("--left-out", "labels that would need training slurries", nargs="*", default=[])
    labelled = {"type": named_file, "nargs": "*", "metavar": "LABEL=PATH"}
    parser.add_input("--models", "model.keras of the surrogates that have one", **labelled)
    parser.add_input("--histories", "history.csv of the same surrogates", **labelled)
    parser.add_input("--figures", "figures (PNG)", nargs="+")
    parser.add_output("--report", "report.html")


def main(args: Namespace) -> None:
    """Read everything and write the report."""
    config_text = args.config.read_text(encoding="utf-8")
    results = Results(
        config=wet_recipes(yaml.safe_load(config_text)),
        config_text=config_text,
        versions=json.loads(args.versions.read_text(encoding="utf-8")),
        roles=args.roles,
        formulations=args.formulations,
        expected_g_cm3=args.expected_g_cm3,
        inputs=read_by_slurry(args.inputs),
        runs=read_by_slurry(args.run_json),
        density=read_table(args.density),
        coordinate_errors=read_table(args.coordinate_errors),
        rdf_errors=read_table(args.rdf_errors),
        equilibrium=read_equilibrium(args.equilibrium),
        relaxation_ends=read_table(args.relaxation_ends),
        **{name: read_table(path) if (path := getattr(args, name)) else None for name in OPTIONAL_TABLES},
        costs=read_table(args.cost_table),
        speedup=read_table(args.speedup),
        surrogates=args.surrogates,
        left_out=args.left_out,
        descriptions={label: described(label) for label in args.surrogates},
        histories={label: read_table(path) for label, path in args.histories},
        networks={label: read_network(path) for label, path in args.models},
        weights_of={label: surrogates.parse(label).surrogate.weights_epoch for label, _ in args.models},
        figures={path.stem: path for path in args.figures},
    )
    write_text(args.report, report_html(results))


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
