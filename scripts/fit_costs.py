"""Fit how the costs of hybrid chain and full DEM grow with particle number, and count when a training is paid back.

In: tables/speedup.csv, tables/cost.csv, and tables/equilibrium.csv for the roles of the slurries.
Out: a table (CSV) of one row for each surrogate and clock (wall_s or cpu_s): the number of slurries with a full DEM;
exponents b of seconds = a particles^b over these, by least squares of the logarithms; seconds of the training (empty
for a model trained elsewhere, 0 where none is recorded) and of the DEM, features and data set of the training
slurries (0 for a surrogate that needs none); median seconds saved a slurry; and after how many slurries the training,
alone and with the training slurries, is paid back (empty where nothing is saved).
"""

import argparse
from pathlib import Path

from slurrycast.files import run_main, write_text
from slurrycast.speedup import scaling
from slurrycast.tables import read_equilibrium, read_table


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--speedup", type=Path, required=True, help="in: tables/speedup.csv")
    parser.add_argument("--cost-table", type=Path, required=True, help="in: tables/cost.csv")
    parser.add_argument("--equilibrium", type=Path, required=True, help="in: tables/equilibrium.csv")
    parser.add_argument(
        "--learns-from-dem",
        nargs="*",
        default=[],
        metavar="LABEL",
        help="surrogates that need the training slurries, for a model or for the mean packing fraction",
    )
    parser.add_argument("--table", type=Path, required=True, help="out: table of both clocks (CSV)")
    return parser.parse_args()


def main() -> None:
    """Read, fit, write."""
    args = parse_args()
    equilibrium = read_equilibrium(args.equilibrium)
    training = list(equilibrium.slurry[equilibrium.role == "train"])
    table = scaling(read_table(args.speedup), read_table(args.cost_table), training, set(args.learns_from_dem))
    write_text(args.table, table.to_csv(index=False, float_format="%.6g"))


if __name__ == "__main__":
    run_main(main)
