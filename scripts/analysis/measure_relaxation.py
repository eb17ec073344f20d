"""Measure how near to rest each relaxed structure is: temperatures, kinetic energy and pressure at its end.

In: relaxed structures (HDF5), whose attributes hold the state at the end of their relaxation.
Out: a table (CSV) of one row a structure: steps, temperature_k of translation and temperature_rotational_k,
pressure_kpa, kinetic_share, the kinetic energy over pressure x volume, densification, the density over that of the
prediction, and a warning where the share or the pressure is out of bounds, or a loose start was hardly looser than the
structure at rest.
"""

import json
import sys

from slurrycast.data.frames import FrameStore, read_frames
from slurrycast.data.tables import write_table
from slurrycast.dem.relaxation import END_STATE, unrest
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import InputError
from slurrycast.surrogates.base import LOOSE_PACKING

MEASURED = (*END_STATE, "densification")
# Below it a random start is about as dense as the structure at rest, which is then too dense: with a friction of 0.5, a
# start at a packing fraction of 0.6 ends 5 % too dense, 1.03 times as dense as it began (docs/evaluation.md).
LEAST_DENSIFICATION = 1.1


def end_row(
    store: FrameStore, pressure_kpa: float, max_kinetic_share: float, pressure_within: float, temperature_k: float
) -> dict:
    """Row of the table for one relaxed structure. InputError if it does not say how its relaxation ended."""
    missing = [name for name in MEASURED if name not in store.attributes]
    if missing:
        raise InputError(f"{store.path}: no attribute {', '.join(missing)}, must be the output of relax_slurry")
    row = {
        "surrogate": store.attributes["surrogate"],
        "slurry": store.attributes["slurry"],
        "steps": json.loads(store.attributes["relaxation"])["steps"],
        **{name: float(store.attributes[name]) for name in MEASURED},
    }
    found = unrest(row, pressure_kpa, max_kinetic_share, pressure_within, temperature_k)
    sentences = [f"not at rest: {'; '.join(found)}"] if found else []
    if store.attributes["box_rule"] == LOOSE_PACKING.name and row["densification"] < LEAST_DENSIFICATION:
        sentences.append(
            f"ends only {row['densification']:.2f} times as dense as its random start: set "
            "surrogate.direct.packing_fraction lower"
        )
    return row | {"warning": "; ".join(sentences)}


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--relaxed", "relaxed structures (HDF5)", nargs="+")
    parser.add_value("--pressure-kpa", "pressure of the barostat", type=float)
    parser.add_value("--max-kinetic-share", "kinetic energy over pressure x volume above which to warn", type=float)
    parser.add_value("--pressure-within", "relative deviation of the pressure above which to warn", type=float)
    parser.add_value("--temperature-k", "set point of the thermostat", type=float)
    parser.add_output("--table", "table of all relaxations (CSV)")
    parser.add_output("--cost", "cost record (JSON)")


def main(args: Namespace) -> None:
    """Measure all structures and write the table; warnings go to stderr too."""
    with measured_cost(args.cost, "measure_relaxation"):
        rows = []
        for path in args.relaxed:
            with read_frames(path) as store:
                bounds = (args.pressure_kpa, args.max_kinetic_share, args.pressure_within, args.temperature_k)
                rows.append(end_row(store, *bounds))
            if rows[-1]["warning"]:
                print("warning: {surrogate}, slurry {slurry}: {warning}".format(**rows[-1]), file=sys.stderr)
        write_table(args.table, rows)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
