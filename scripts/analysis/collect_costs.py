"""Collect the cost records of all jobs in one table.

In: cost records in the order of the workflow, and the run.json of every DEM run.
Out: a table (CSV) of one row a job in the same order: stage, surrogate, slurry, particles, steps (of the DEM), wall_s,
cpu_s, max_rss_mb. Right after run_slurry stands run_slurry_to_input: the part of each DEM run up to the last input
frame, which is all that a hybrid run needs of it.
"""

import json
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from slurrycast.data.tables import write_table
from slurrycast.evaluation.speedup import dem_seconds
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import Cost, read_cost
from slurrycast.runtime.files import InputError


def cost_to_input(path: Path, input_steps: int) -> dict:
    """Row of the DEM's part up to step `input_steps`, from the segments of its run.json; memory is not known.

    A segment that goes on beyond that step counts by its share of steps.
    """
    run = json.loads(path.read_text(encoding="utf-8"))
    if run["segments"][-1]["step_end"] < input_steps:
        raise InputError(f"{path}: ends before step {input_steps} of the last input frame")
    wall_s, cpu_s = (dem_seconds(run, input_steps, clock) for clock in ("wall_s", "cpu_s"))
    cost = Cost("run_slurry_to_input", "-", run["slurry"], run["particles"], input_steps, wall_s, cpu_s)
    return asdict(cost) | {"max_rss_mb": None}


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--costs", "cost records of all jobs (JSON)", nargs="+")
    parser.add_input("--run-json", "run.json of every DEM run, none where nothing is simulated", nargs="*")
    parser.add_value("--input-steps", "DEM step of the last input frame", type=int)
    parser.add_output("--table", "table of costs (CSV)")


def main(args: Namespace) -> None:
    """Collect all records and write the table."""
    rows = [asdict(read_cost(path)) for path in args.costs]
    after_dem = max((place for place, row in enumerate(rows, 1) if row["stage"] == "run_slurry"), default=0)
    rows[after_dem:after_dem] = [cost_to_input(path, args.input_steps) for path in args.run_json]
    table = pd.DataFrame(rows).astype({"particles": "Int64", "steps": "Int64"})
    write_table(args.table, table)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
