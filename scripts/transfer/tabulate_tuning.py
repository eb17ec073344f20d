"""Tabulate the error against the number of slurries that a surrogate was trained on, fine-tuned and from scratch.

In: tables and cost records of tune_surrogate.py.
Out: tables/tuning.csv, one row a surrogate, start and number of slurries: number of predicted slurries, mean, least and
greatest skill over them, mean squared error (um2) and that of the affine map, and CPU seconds of training and
prediction.
"""

import pandas as pd

from slurrycast.data.tables import read_table, write_table
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import read_cost


def row_of(table: pd.DataFrame, cpu_s: float) -> dict:
    """Row of the table of one training."""
    return {
        **table[["surrogate", "start", "slurries"]].iloc[0],
        "predicted": len(table),
        "skill": table.skill.mean(),
        "least_skill": table.skill.min(),
        "greatest_skill": table.skill.max(),
        "mse_um2": table.mse_um2.mean(),
        "mse_affine_um2": table.mse_affine_um2.mean(),
        "cpu_s": cpu_s,
    }


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--tunings", "tables of tune_surrogate.py (CSV)", nargs="+")
    parser.add_input("--costs", "cost records of the same (JSON)", nargs="+")
    parser.add_output("--table", "table of trainings (CSV)")
    parser.one_each("tunings", "costs")


def main(args: Namespace) -> None:
    """Tabulate all trainings."""
    pairs = zip(args.tunings, args.costs, strict=True)
    write_table(args.table, [row_of(read_table(path), read_cost(cost).cpu_s) for path, cost in pairs], digits=6)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
