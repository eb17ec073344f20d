"""Put the frames of a slurry's LAMMPS dump into a compact HDF5 file (H5MD layout) and check it against the dump.

In: the dump (um), and the JSON files of generate_inputs.py and run_slurry.py, which say what the dump has to hold.
Out: particles (id, phase, size class, radius, mass), unwrapped and scaled unwrapped coordinates in float64,
coordination numbers and the box of each frame, with units as attributes, and physics, seeds and LAMMPS version as
provenance.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from slurrycast.costs import measured_cost
from slurrycast.files import InputError, run_main
from slurrycast.frames import Frame, Particles, read_frames, write_frames
from slurrycast.lammps_dump import DumpFrame, read_dump


def parse_args() -> argparse.Namespace:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dump", required=True, type=Path, help="in: LAMMPS text dump")
    parser.add_argument("--inputs", required=True, type=Path, help="in: JSON of generate_inputs.py")
    parser.add_argument("--run", required=True, type=Path, help="in: JSON of run_slurry.py")
    parser.add_argument("--frames", required=True, type=Path, help="out: frame store, HDF5")
    parser.add_argument("--cost", required=True, help="out: cost record, JSON")
    return parser.parse_args()


def particles_of(inputs: dict, dump: Path, frame: DumpFrame) -> Particles:
    """Describe the particles of a dump by the type table of the inputs; InputError where the two do not fit."""
    ids, kinds, radius_um = frame.values[:, 0].astype(int), frame.values[:, 1].astype(int), frame.values[:, 2]
    table = {t["type"]: t for t in inputs["types"]}
    expected = [t["particles"] for t in inputs["types"]]
    counts = [int((kinds == number).sum()) for number in table]
    if counts != expected or len(kinds) != sum(expected):
        raise InputError(f"{dump}: {counts} particles of the types {list(table)}, the recipe has {expected}")
    rows = [table[int(kind)] for kind in kinds]
    if not np.allclose(radius_um, [row["diameter_um"] / 2 for row in rows], rtol=1e-12):
        raise InputError(f"{dump}: radii differ from those of the recipe")
    return Particles(
        id=ids,
        type=kinds,
        phase=np.array([row["phase_index"] for row in rows]),
        size_class=np.array([row["size_class"] for row in rows]),
        radius_um=radius_um,
        mass_pg=np.array([row["density_g_cm3"] for row in rows]) * 4 / 3 * np.pi * radius_um**3,
        phase_names=tuple(dict.fromkeys(row["phase"] for row in inputs["types"])),
    )


def as_frame(frame: DumpFrame, number: int, timestep_us: float) -> Frame:
    """A dump frame as a frame of the store."""
    return Frame(
        number=number,
        step=frame.step,
        time_us=frame.step * timestep_us,
        position_um=frame.values[:, 3:6],
        scaled_position=frame.values[:, 6:9],
        coordination=frame.values[:, 9].astype(np.int32),
        lower_um=frame.lower_um,
        edges_um=frame.edges_um,
    )


def main() -> None:
    """Convert and check."""
    args = parse_args()
    inputs, run = json.loads(args.inputs.read_text()), json.loads(args.run.read_text())
    dem = inputs["physics"]["dem"]
    frame_steps = dem["steps"] // (dem["frames"] - 1)
    with measured_cost(args.cost, "extract_frames", slurry=inputs["slurry"]) as cost:
        dump = read_dump(args.dump)
        first = next(dump)
        last = first

        def frames() -> Iterator[Frame]:
            nonlocal last
            yield as_frame(first, 0, dem["timestep_us"])
            for number, last in enumerate(dump, 1):
                if last.step != number * frame_steps:
                    raise InputError(f"{args.dump}: frame {number} is step {last.step}, not {number * frame_steps}")
                yield as_frame(last, number, dem["timestep_us"])
            if last.step != run["steps"]:
                raise InputError(f"{args.dump}: ends at step {last.step}, the run at step {run['steps']}")

        attributes = {
            "slurry": inputs["slurry"],
            "physics": json.dumps(inputs["physics"]),
            "seeds": json.dumps(inputs["seeds"]),
            "lammps_version": run["lammps_version"],
        }
        write_frames(args.frames, particles_of(inputs, args.dump, first), frames(), attributes)
        with read_frames(args.frames) as store:
            if not np.array_equal(store.position_um(run["frames_written"] - 1), last.values[:, 3:6]):
                raise InputError(f"{args.frames}: the last frame reads back differently from how it was written")
            cost.particles = len(store.particles)
    print(f"[{inputs['slurry']}] {run['frames_written']} frames of {cost.particles} particles")


if __name__ == "__main__":
    run_main(main)
