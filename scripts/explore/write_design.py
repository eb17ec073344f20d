"""Write the design of an exploration: a table of recipes that fill the ranges of their inputs.

In: the ranges, and how many recipes are wanted.
Out: a table (CSV): id (P1 and so on, C1 and so on at the centre), confirm (`yes`: the full DEM too), and the inputs,
whose mass fractions keep their sum. A scrambled Sobol sequence gives the points, so a design of fewer begins with the
same ones.
"""

import json

from slurrycast.data.tables import write_table
from slurrycast.explore.design import design
from slurrycast.explore.inputs import InputSpace
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--ranges", "JSON: lowest and highest value of each input", type=json.loads)
    parser.add_value("--share-total", "what the mass fractions among the inputs sum to", type=float)
    parser.add_value("--points", "number of different recipes", type=int)
    parser.add_value("--replicas", "number of slurries at the centre", type=int)
    parser.add_value("--confirmations", "number of recipes that get a full DEM too", type=int)
    parser.add_value("--seed", "seed of the design", type=int)
    parser.add_output("--table", "table of recipes, CSV")


def main(args: Namespace) -> None:
    """Make the design and write it."""
    space = InputSpace.of_ranges(args.ranges, args.share_total)
    table = design(space, args.points, args.replicas, args.confirmations, args.seed)
    write_table(args.table, table)
    print(f"{args.table}: {args.points} recipes of {len(space.names)} inputs, {args.replicas} slurries at the centre")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
