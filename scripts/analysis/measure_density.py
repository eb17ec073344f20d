"""Measure density and volume of final structures, simulated (model DEM) and predicted (model hybrid).

In: frame stores (HDF5): the DEM frames of slurries that were run to the end, and relaxed structures.
Out: a table (CSV) of one row a structure, that of the DEM at the target frame: density_g_cm3 and volume_um3 of the
periodic box with all its particles; the surrogate of DEM rows is `-`.
"""

import argparse

import pandas as pd

from slurrycast.data.frames import FrameStore, read_frames
from slurrycast.runtime.command_line import Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import write_text


def density_row(store: FrameStore, frame: int, surrogate: str, model: str) -> dict:
    """Row of the table for one structure."""
    return {
        "surrogate": surrogate,
        "slurry": store.attributes["slurry"],
        "model": model,
        "density_g_cm3": store.density_g_cm3(frame),
        "volume_um3": store.volume_um3(frame),
    }


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_input(
        "--frames",
        "DEM frames of slurries run to the end (HDF5), none where all are new",
        nargs="*",
    )
    parser.add_input("--relaxed", "relaxed structures (HDF5)", nargs="+")
    parser.add_argument("--target-frame", type=int, required=True, help="number of the final DEM frame")
    parser.add_output("--table", "table of densities and volumes (CSV)")
    parser.add_output("--cost", "cost record (JSON)")
    return parser.parse_args()


def main() -> None:
    """Measure every structure and write the table."""
    args = parse_args()
    with measured_cost(args.cost, "measure_density"):
        rows = []
        for path in args.frames:
            with read_frames(path) as store:
                rows.append(density_row(store, args.target_frame, "-", "DEM"))
        for path in args.relaxed:
            with read_frames(path) as store:
                rows.append(density_row(store, store.last, store.attributes["surrogate"], "hybrid"))
        write_text(args.table, pd.DataFrame(rows).to_csv(index=False, float_format="%.9g"))


if __name__ == "__main__":
    run_main(main)
