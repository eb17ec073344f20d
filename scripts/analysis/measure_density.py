"""Measure density and volume of final structures, simulated (model DEM) and predicted (model hybrid).

In: frame stores (HDF5): the DEM frames of slurries that were run to the end, and relaxed structures.
Out: a table (CSV) of one row a structure, that of the DEM at the target frame: density_g_cm3 and volume_um3 of the
periodic box with all its particles; the surrogate of DEM rows is `-`.
"""

from slurrycast.data.frames import FrameStore, read_frames
from slurrycast.data.tables import write_table
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost


def density_row(store: FrameStore, frame: int, surrogate: str, model: str) -> dict:
    """Row of the table for one structure."""
    return {
        "surrogate": surrogate,
        "slurry": store.attributes["slurry"],
        "model": model,
        "density_g_cm3": store.density_g_cm3(frame),
        "volume_um3": store.volume_um3(frame),
    }


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--frames", "DEM frames of slurries run to the end (HDF5), none where all are new", nargs="*")
    parser.add_input("--relaxed", "relaxed structures (HDF5)", nargs="+")
    parser.add_value("--target-frame", "number of the final DEM frame", type=int)
    parser.add_output("--table", "table of densities and volumes (CSV)")
    parser.add_output("--cost", "cost record (JSON)")


def main(args: Namespace) -> None:
    """Measure every structure and write the table."""
    with measured_cost(args.cost, "measure_density"):
        rows = []
        for path in args.frames:
            with read_frames(path) as store:
                rows.append(density_row(store, args.target_frame, "-", "DEM"))
        for path in args.relaxed:
            with read_frames(path) as store:
                rows.append(density_row(store, store.last, store.attributes["surrogate"], "hybrid"))
        write_table(args.table, rows)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
