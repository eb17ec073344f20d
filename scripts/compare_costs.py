"""Compare what the hybrid chain costs for each slurry with the full DEM and with the DEM up to its equilibrium.

In: cost.csv, equilibrium.csv and the run.json of every slurry.
Out: a table (CSV, seconds): surrogate, slurry, clock (wall_s or cpu_s), particles, the parts of the hybrid chain and
their sum, the full DEM, the DEM to equilibrium, and the ratios of these two to the hybrid chain; empty where a slurry
was not run to the end or did not reach equilibrium. Start-up of LAMMPS counts on both sides.
"""

import argparse
import json
from pathlib import Path

import pandas as pd

from slurrycast.files import run_main, write_text
from slurrycast.speedup import compare_costs, read_equilibrium


def parse_args() -> argparse.Namespace:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cost-table", type=Path, required=True, help="tables/cost.csv")
    parser.add_argument("--equilibrium", type=Path, required=True, help="tables/equilibrium.csv")
    parser.add_argument("--run-json", nargs="+", type=Path, required=True, help="run.json of every slurry")
    parser.add_argument("--table", type=Path, required=True, help="table to write (CSV)")
    return parser.parse_args()


def main() -> None:
    """Read, compare, write."""
    args = parse_args()
    runs = [json.loads(path.read_text(encoding="utf-8")) for path in args.run_json]
    costs = pd.read_csv(args.cost_table, dtype={"slurry": str})
    equilibrium = read_equilibrium(args.equilibrium)
    by_slurry = {run["slurry"]: run for run in runs}
    tables = [compare_costs(costs, equilibrium, by_slurry, clock) for clock in ("wall_s", "cpu_s")]
    write_text(args.table, pd.concat(tables).to_csv(index=False, float_format="%.6g"))


if __name__ == "__main__":
    run_main(main)
