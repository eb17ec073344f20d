"""Run the twin of a DEM run: the same from an early frame on, but for positions moved by a hair.

How far the two are apart at the target frame tells how well a frame so early determines the end at all.

In: the restart file of the early frame, the slurry's inputs (JSON) and pair coefficients, and its frame store (HDF5),
for what the particles are.
Out: the twin at the target frame, as a frame store of one frame (HDF5). Every coordinate is displaced by a random
length between plus and minus --displacement-um; its seed follows from that of the slurry.
"""

import argparse
import json
from pathlib import Path

from slurrycast.command_line import Parser, input_file, run_main
from slurrycast.costs import measured_cost
from slurrycast.files import InputError
from slurrycast.frames import read_frames, write_frames
from slurrycast.lammps_dump import as_frame, read_dump
from slurrycast.lammps_run import Launcher, Progress, continue_dem, steps_per_frame
from slurrycast.recipe import derived_seed
from slurrycast.work_folder import work_folder


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument("--restart", required=True, type=input_file, help="in: LAMMPS restart file of --first-frame")
    parser.add_argument("--inputs", required=True, type=input_file, help="in: JSON of generate_inputs.py")
    parser.add_argument(
        "--coefficients", required=True, type=input_file, help="in: pair_coeff lines of the real forces"
    )
    parser.add_argument("--frames", type=input_file, required=True, help="in: DEM frames of the slurry, HDF5")
    parser.add_argument("--first-frame", required=True, type=int, help="number of the frame that the twin starts from")
    parser.add_argument("--target-frame", required=True, type=int, help="number of the frame at which the twin ends")
    parser.add_argument("--displacement-um", required=True, type=float, help="longest displacement of a coordinate, um")
    parser.add_argument("--work", required=True, type=Path, help="work folder; kept with the logs if LAMMPS fails")
    parser.add_argument("--executable", default="lmp", help="LAMMPS: a name on PATH or a path")
    parser.add_argument("--launcher", default="mpiexec", help="put before the executable when ranks > 1")
    parser.add_argument("--ranks", default=1, type=int, help="MPI ranks")
    parser.add_argument("--twin", required=True, help="out: the twin at the target frame, HDF5")
    parser.add_argument("--cost", required=True, help="out: cost record, JSON")
    args = parser.parse_args()
    if not 0 <= args.first_frame < args.target_frame:
        parser.error(f"--first-frame {args.first_frame}: must be from 0 to below --target-frame {args.target_frame}")
    return args


def main() -> None:
    """Run and write."""
    args = parse_args()
    inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
    slurry, dem = inputs["slurry"], inputs["physics"]["dem"]
    first, last = (frame * steps_per_frame(dem) for frame in (args.first_frame, args.target_frame))
    with (
        work_folder(args.work),
        measured_cost(args.cost, "run_twin", slurry=slurry) as cost,
        read_frames(args.frames) as store,
    ):
        log = continue_dem(
            Launcher(args.executable, args.launcher, args.ranks),
            inputs,
            args.restart,
            args.coefficients,
            args.work,
            {
                "round_steps": last - first,
                "max_rounds": 1,
                "flat_within": 0,
                "pressure_within": 0,
                "displacement_um": args.displacement_um,
                "displacement_seed": derived_seed(inputs["physics"]["slurry"]["seed"], "twin"),
                "thermo_every_steps": dem["thermo_every_steps"],
            },
            Progress(f"{slurry} twin", first, last, print),
        )
        (end,) = read_dump(args.work / "continued.dump")
        if end.step != last:
            raise InputError(f"{args.restart}: of step {end.step - last + first}, frame {args.first_frame} is {first}")
        attributes = {
            **store.attributes,
            "stage": "twin",
            "first_frame": args.first_frame,
            "displacement_um": args.displacement_um,
            "lammps_version": log.version,
        }
        frame = as_frame(end, args.target_frame, dem["timestep_us"])
        write_frames(args.twin, store.particles, [frame], attributes)
        cost.particles, cost.steps = len(store.particles), last - first
    print(f"[{slurry}] twin from frame {args.first_frame} to {args.target_frame}")


if __name__ == "__main__":
    run_main(main)
