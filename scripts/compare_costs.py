"""Compare what the hybrid chain costs for each slurry with the full DEM and with the DEM up to its equilibrium.

In: tables/cost.csv, tables/equilibrium.csv and the run.json of every slurry.
Out: a table (CSV, seconds): surrogate, slurry, clock (wall_s or cpu_s), particles, the parts of the hybrid chain and
their sum, the full DEM, the DEM to equilibrium, and the ratios of these two to the hybrid chain. The full DEM and its
ratio are empty for a new slurry, those to equilibrium also for one that did not reach it. Start-up of LAMMPS counts on
both sides.
"""

import argparse
import json
from pathlib import Path

import pandas as pd

from slurrycast.files import run_main, write_text
from slurrycast.speedup import compare_costs
from slurrycast.tables import read_equilibrium, read_table


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cost-table", type=Path, required=True, help="in: tables/cost.csv")
    parser.add_argument("--equilibrium", type=Path, required=True, help="in: tables/equilibrium.csv")
    parser.add_argument("--run-json", nargs="+", type=Path, required=True, help="in: run.json of every slurry")
    parser.add_argument("--table", type=Path, required=True, help="out: table of both clocks (CSV)")
    return parser.parse_args()


def main() -> None:
    """Read, compare, write."""
    args = parse_args()
    runs = [json.loads(path.read_text(encoding="utf-8")) for path in args.run_json]
    costs = read_table(args.cost_table)
    equilibrium = read_equilibrium(args.equilibrium)
    by_slurry = {run["slurry"]: run for run in runs}
    tables = [compare_costs(costs, equilibrium, by_slurry, clock) for clock in ("wall_s", "cpu_s")]
    write_text(args.table, pd.concat(tables).to_csv(index=False, float_format="%.6g"))


if __name__ == "__main__":
    run_main(main)
