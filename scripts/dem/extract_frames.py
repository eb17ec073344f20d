"""Put the frames of a slurry's LAMMPS dump into a compact HDF5 file (H5MD layout) and check it against the dump.

In: the dump (um), and the JSON files of generate_inputs.py and run_slurry.py, which say what the dump has to hold.
Out: particles (id, phase, size class, radius, mass), unwrapped and scaled unwrapped coordinates in float64,
coordination numbers and the box of each frame, with units as attributes, and physics, seeds and LAMMPS version as
provenance.
"""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from slurrycast.data.frames import Frame, FrameStore, Particles, read_frames, write_frames
from slurrycast.dem.lammps_dump import DumpFrame, as_frame, read_dump
from slurrycast.dem.lammps_run import steps_per_frame
from slurrycast.dem.particles import particles_of
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import InputError


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--dump", "LAMMPS text dump")
    parser.add_input("--inputs", "JSON of generate_inputs.py")
    parser.add_input("--run", "JSON of run_slurry.py")
    parser.add_argument("--work", type=Path, help="work folder of run_slurry.py, removed when the frames are safe")
    parser.add_output("--frames", "frame store, HDF5")
    parser.add_output("--cost", "cost record, JSON")


def particles_of_dump(inputs: dict, dump: Path, frame: DumpFrame) -> Particles:
    """Describe the particles of a dump by the type table of the inputs; InputError where the two do not fit."""
    ids, kinds, radius_um = frame.values[:, 0].astype(int), frame.values[:, 1].astype(int), frame.values[:, 2]
    numbers, expected = ([t[key] for t in inputs["types"]] for key in ("type", "particles"))
    counts = [int((kinds == number).sum()) for number in numbers]
    if counts != expected or len(kinds) != sum(expected):
        raise InputError(f"{dump}: {counts} particles of the types {numbers}, the recipe has {expected}")
    particles = particles_of(inputs["types"], ids, kinds)
    if not np.allclose(radius_um, particles.radius_um, rtol=1e-12):
        raise InputError(f"{dump}: radii differ from those of the recipe")
    return particles


def frames_of(dump: Path, last_frame: int, frame_steps: int, timestep_us: float) -> Iterator[Frame]:
    """Read the frames 0 to `last_frame` of a dump; InputError unless they are these, at their steps."""
    number = -1
    for number, frame in enumerate(read_dump(dump)):
        if number > last_frame or frame.step != number * frame_steps:
            expected = f"step {number * frame_steps}" if number <= last_frame else f"the end after frame {last_frame}"
            raise InputError(f"{dump}: frame {number} is step {frame.step} in place of {expected}")
        yield as_frame(frame, number, timestep_us)
    if number < last_frame:
        raise InputError(f"{dump}: ends after frame {number}, the run has {last_frame + 1} frames")


def check(store: FrameStore, frame: Frame) -> None:
    """Refuse a store that does not give back `frame` to the last digit."""
    lower_um, edges_um = store.box(frame.number)
    pairs = (
        (store.position_um(frame.number), frame.position_um),
        (store.scaled_position(frame.number), frame.scaled_position),
        (store.coordination(frame.number), frame.coordination),
        (lower_um, frame.lower_um),
        (edges_um, frame.edges_um),
    )
    if not all(np.array_equal(*pair) for pair in pairs):
        raise InputError(f"{store.path}: frame {frame.number} reads back differently from the dump")


def main(args: Namespace) -> None:
    """Convert, then read both files again and compare every frame: the dump is deleted after this."""
    inputs, run = (json.loads(path.read_text(encoding="utf-8")) for path in (args.inputs, args.run))
    dem = inputs["physics"]["dem"]
    expected = (args.dump, run["frames_written"] - 1, steps_per_frame(dem), dem["timestep_us"])
    with measured_cost(args.cost, "extract_frames", slurry=inputs["slurry"]) as cost:
        attributes = {
            "slurry": inputs["slurry"],
            "physics": json.dumps(inputs["physics"]),
            "seeds": json.dumps(inputs["seeds"]),
            "lammps_version": run["lammps_version"],
        }
        particles = particles_of_dump(inputs, args.dump, next(read_dump(args.dump)))
        write_frames(args.frames, particles, frames_of(*expected), attributes)
        with read_frames(args.frames) as store:
            for frame in frames_of(*expected):
                check(store, frame)
        cost.particles = len(particles)
    if args.work:
        shutil.rmtree(args.work, ignore_errors=True)
    print(f"[{inputs['slurry']}] {run['frames_written']} frames of {cost.particles} particles")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
