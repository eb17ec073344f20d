"""Fit how the costs of hybrid chain and full DEM grow with particle number, and count when a training is paid back.

In: cost records of all jobs of the hybrid chain and of the training, tables/equilibrium.csv for the roles of the
slurries, the run.json of every slurry compared, and the DEM step of each surrogate's last input frame.
Out: a table (CSV) of one row for each surrogate and clock (wall_s or cpu_s): the number of slurries with a full DEM,
the fewest and most particles of these; exponents b of seconds = a particles^b over them, by least squares of the
logarithms, with standard errors (empty for less than 3 slurries, or sizes that span less than a factor of 2); seconds
of the training (0 where none is recorded) and of the DEM, features and data set of the training slurries (0 for a
surrogate that needs none), both empty for a model trained elsewhere; median seconds saved a slurry of role test; and
after how many slurries the training, alone and with the training slurries, is paid back (empty where nothing is saved).
"""

import argparse

import pandas as pd

from slurrycast.data.tables import read_equilibrium
from slurrycast.evaluation.speedup import add_dem_runs, compare_costs, read_costs, read_runs, scaling
from slurrycast.runtime.command_line import Parser, run_main
from slurrycast.runtime.files import write_text


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_input(
        "--costs",
        "cost records (JSON) of generate_inputs, extract_frames, predict_slurry, wrap_slurry, relax_slurry, "
        "of run_slurry of the training slurries, and of train_surrogate, fit_surrogate, adopt_model, measure_packing "
        "and assemble_dataset as far as there are any",
        nargs="+",
    )
    add_dem_runs(parser)
    parser.add_argument(
        "--learns-from-dem",
        nargs="*",
        default=[],
        metavar="LABEL",
        help="surrogates that need the training slurries, for a model or for the mean packing fraction",
    )
    parser.add_output("--table", "table of both clocks (CSV)")
    return parser.parse_args()


def main() -> None:
    """Read, fit, write."""
    args = parse_args()
    costs, runs = read_costs(args.costs), read_runs(args.run_json)
    equilibrium = read_equilibrium(args.equilibrium)
    speedup = pd.concat(
        compare_costs(costs, equilibrium, runs, dict(args.input_steps), clock) for clock in ("wall_s", "cpu_s")
    )
    roles = dict(zip(equilibrium.slurry, equilibrium.role, strict=True))
    table = scaling(speedup, costs, roles, set(args.learns_from_dem))
    write_text(args.table, table.to_csv(index=False, float_format="%.6g"))


if __name__ == "__main__":
    run_main(main)
