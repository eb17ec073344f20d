"""Measure the packing fraction at which slurries of a recipe end: it gives the final box of one that is not yet run.

In: frame stores (HDF5) of its training slurries, or, where it has none, of relaxed predictions; or one fraction given
by hand.
Out: nominal packing fraction (volume of all spheres over that of the box) of each slurry at the target frame, and their
mean, as JSON, which says whether they are of the DEM or relaxed predictions, and of which surrogate.
"""

import json

import numpy as np

from slurrycast.data.frames import read_frames
from slurrycast.dem.particles import total_volume_um3
from slurrycast.runtime.command_line import Namespace, Parser, input_file, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import write_text


def add_options(parser: Parser) -> None:
    """Add the options."""
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--frames", type=input_file, nargs="+", help="in: frame stores of slurries")
    source.add_argument("--given", type=float, help="a packing fraction to be used as it is")
    parser.add_value("--target-frame", "number of the frame that is measured", type=int, default=None)
    parser.add_output("--packing", "packing fractions, JSON")
    parser.add_output("--cost", "cost record, JSON")


def main(args: Namespace) -> None:
    """Measure and write."""
    with measured_cost(args.cost, "measure_packing"):
        fractions, source = {}, "configuration"
        for path in args.frames or []:
            with read_frames(path) as store:
                share = total_volume_um3(store.particles) / store.volume_um3(args.target_frame)
                fractions[str(store.attributes["slurry"])] = share
                source = str(store.attributes.get("surrogate", "dem"))
        mean = float(np.mean(list(fractions.values()))) if fractions else args.given
        write_text(args.packing, json.dumps({"mean": mean, "source": source, "slurries": fractions}, indent=1) + "\n")
    print(
        f"packing fraction {mean:.4f}"
        + (f", mean of {', '.join(fractions)} ({source})" if fractions else ", as configured")
    )


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
