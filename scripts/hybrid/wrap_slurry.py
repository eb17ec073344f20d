"""Wrap a predicted microstructure into its periodic box.

In: predicted unwrapped coordinates (um, HDF5) and the type table of the slurry (JSON of generate_inputs.py).
Out: a LAMMPS data file with every particle inside the box.
"""

import json

from slurrycast.data.frames import read_frames
from slurrycast.dem.recipe import particle_types
from slurrycast.dem.relaxation import check_slurry, write_wrapped
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--predicted", "predicted microstructure, HDF5")
    parser.add_input("--inputs", "JSON of generate_inputs.py")
    parser.add_output("--wrapped", "LAMMPS data file")
    parser.add_output("--cost", "cost record, JSON")


def main(args: Namespace) -> None:
    """Wrap and write."""
    inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
    with read_frames(args.predicted) as store:
        check_slurry(store, inputs)
        types = particle_types(inputs["physics"]["formulation"]["phases"])
        slurry, surrogate = (str(store.attributes[name]) for name in ("slurry", "surrogate"))
        with measured_cost(args.cost, "wrap_slurry", surrogate, slurry) as cost:
            cost.particles = len(store.particles)
            write_wrapped(args.wrapped, f"slurry {slurry} as predicted by {surrogate}", types, store)
    print(f"[{slurry}] {cost.particles} particles wrapped")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
