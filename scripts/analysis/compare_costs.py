"""Compare the cost of the hybrid chain for each slurry, end to end, with the full DEM and the DEM to equilibrium.

In: tables/cost.csv, tables/equilibrium.csv, the run.json of every slurry that has a DEM, and the DEM step of each
surrogate's last input frame.
Out: a table (CSV, seconds): surrogate, slurry, clock (wall_s or cpu_s), particles, the parts of the hybrid chain and
their sum, the full DEM, the DEM to equilibrium, and the ratios of these two to the hybrid chain; drying of the hybrid's
tape and the measures of slurry and tape, both ways up to a measured tape, and their ratio, empty where no tape is made.
The full DEM and its ratio are empty for a new slurry, those to equilibrium also for one that did not reach it. The
making of the inputs and the start-up of LAMMPS count on both sides; of the extraction of frames, only those up to the
last input frame.
"""

import pandas as pd

from slurrycast.data.tables import read_equilibrium, read_table, write_table
from slurrycast.evaluation.speedup import add_dem_runs, compare_costs, read_by_slurry
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--cost-table", "tables/cost.csv")
    add_dem_runs(parser)
    parser.add_output("--table", "table of both clocks (CSV)")


def main(args: Namespace) -> None:
    """Read, compare, write."""
    costs, equilibrium = read_table(args.cost_table), read_equilibrium(args.equilibrium)
    runs, input_steps = read_by_slurry(args.run_json), dict(args.input_steps)
    tables = [compare_costs(costs, equilibrium, runs, input_steps, clock) for clock in ("wall_s", "cpu_s")]
    write_table(args.table, pd.concat(tables), digits=6)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
