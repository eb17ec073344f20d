"""Measure how near to rest each tape is: temperatures, kinetic energy and pressure at the end of its drying.

In: tapes (HDF5), whose attributes hold thickness and state at the end.
Out: a table (CSV) of one row a tape: source (dem or a surrogate) and slurry; slurry_thickness_um and tape_thickness_um
of the box; temperature_k of translation and temperature_rotational_k, pressure_kpa along z, kinetic_share, the kinetic
energy over pressure x volume, and a warning where the share or the pressure is out of bounds.
"""

import sys

from slurrycast.data.frames import read_frames
from slurrycast.data.tables import write_table
from slurrycast.dem.relaxation import END_STATE, unrest
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

MEASURED = ("slurry_thickness_um", "tape_thickness_um", *END_STATE)


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--dried", "tapes (HDF5)", nargs="+")
    parser.add_value("--pressure-kpa", "pressure of the barostat", type=float)
    parser.add_value("--max-kinetic-share", "kinetic energy over pressure x volume above which to warn", type=float)
    parser.add_value("--pressure-within", "relative deviation of the pressure above which to warn", type=float)
    parser.add_value("--temperature-k", "set point of the thermostat", type=float)
    parser.add_output("--table", "table of all tapes (CSV)")


def main(args: Namespace) -> None:
    """Measure all tapes and write the table; warnings go to stderr too."""
    rows = []
    for path in args.dried:
        with read_frames(path) as store:
            missing = [name for name in MEASURED if name not in store.attributes]
            if missing:
                raise InputError(f"{path}: no attribute {', '.join(missing)}, must be the output of dry_slurry")
            row = {
                "source": store.attributes.get("surrogate", "dem"),
                "slurry": store.attributes["slurry"],
                **{name: float(store.attributes[name]) for name in MEASURED},
            }
        found = unrest(row, args.pressure_kpa, args.max_kinetic_share, args.pressure_within, args.temperature_k)
        rows.append(row | {"warning": f"not at rest: {'; '.join(found)}" if found else ""})
        if found:
            print("warning: tape of {source}, slurry {slurry}: {warning}".format(**rows[-1]), file=sys.stderr)
    write_table(args.table, rows)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
