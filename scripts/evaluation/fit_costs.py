"""Fit how the costs of hybrid chain and full DEM grow with particle number, and count when a training is paid back.

In: cost records of all jobs of the hybrid chain and of the training, tables/equilibrium.csv for the roles of the
slurries, the run.json of every slurry compared, and the DEM step of each surrogate's last input frame.
Out: a table (CSV) of one row for each surrogate and clock (wall_s or cpu_s): the number of slurries with a full DEM,
the fewest and most particles of these; exponents b of seconds = a particles^b over them, by least squares of the
logarithms, with standard errors (empty for less than 3 slurries, or sizes that span less than a factor of 2); seconds
of the training (0 where none is recorded) and of the DEM, features and data set of the training slurries (0 for a
surrogate that needs none), both empty for a model trained elsewhere, at least at first; median seconds saved a slurry
of role test; and after how many slurries the training, alone and with the training slurries, is paid back (empty where
nothing is saved).
"""

import pandas as pd

from slurrycast.data.tables import read_equilibrium, write_table
from slurrycast.evaluation.speedup import add_dem_runs, compare_costs, read_by_slurry, read_costs, scaling
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input(
        "--costs",
        "cost records (JSON) of generate_inputs, extract_frames, predict_slurry, wrap_slurry, relax_slurry, "
        "of run_slurry of the training slurries, and of train_surrogate, fit_surrogate, adopt_model, measure_packing "
        "and assemble_dataset as far as there are any",
        nargs="+",
    )
    add_dem_runs(parser)
    parser.add_value(
        "--learns-from-dem",
        "surrogates that need the training slurries, for a model or for the mean packing fraction",
        nargs="*",
        default=[],
        metavar="LABEL",
    )
    parser.add_value(
        "--trained-elsewhere",
        "surrogates whose training began with a stored model, or ended with it",
        nargs="*",
        default=[],
        metavar="LABEL",
    )
    parser.add_output("--table", "table of both clocks (CSV)")


def main(args: Namespace) -> None:
    """Read, fit, write."""
    costs, runs = read_costs(args.costs), read_by_slurry(args.run_json)
    equilibrium = read_equilibrium(args.equilibrium)
    speedup = pd.concat(
        compare_costs(costs, equilibrium, runs, dict(args.input_steps), clock) for clock in ("wall_s", "cpu_s")
    )
    roles = dict(zip(equilibrium.slurry, equilibrium.role, strict=True))
    table = scaling(speedup, costs, roles, set(args.learns_from_dem), set(args.trained_elsewhere))
    write_table(args.table, table, digits=6)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
