"""Make a perturbed run of a DEM run: the same from an early frame on, with positions displaced by a tiny length.

The distance between the two at the target frame shows how well such an early frame determines the end.

In: the restart file of the early frame, the slurry's inputs (JSON) and pair coefficients, its run.json, for where it
was cut, and its frame store (HDF5), for what the particles are.
Out: the perturbed run at the target frame, as a frame store of one frame (HDF5). Every coordinate is displaced by a
random length between plus and minus --displacement-um; its seed follows from that of the slurry.

The perturbed run is cut into the same segments as its original, and as there the work folder holds the restart file of
each finished one: a perturbed run that was killed goes on from the last one when it is started again with the same
inputs, and ends with the same numbers. It stops on purpose as run_slurry.py does. The work folder is removed with the
perturbed run written.
"""

import contextlib
import json
import shutil
from pathlib import Path

from slurrycast.data.frames import read_frames, write_frames
from slurrycast.dem.chain import COEFFICIENTS, Chain, Opening, check_restart, identity
from slurrycast.dem.lammps_dump import as_frame, read_dump
from slurrycast.dem.lammps_log import read_log
from slurrycast.dem.lammps_run import Launcher, refuse_lost_history, steps_per_frame
from slurrycast.dem.recipe import derived_seed
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError
from slurrycast.runtime.stopping import Stop
from slurrycast.runtime.work_folder import attempt_log, work_folder

LAMMPS_SCRIPTS = ("displace.lmp", "slurry.lmp")
START = "start.restart"  # in the work folder


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--restart", "LAMMPS restart file of --first-frame")
    parser.add_input("--inputs", "JSON of generate_inputs.py")
    parser.add_input("--coefficients", "pair_coeff lines of the real forces")
    parser.add_input("--run", "run.json of the slurry")
    parser.add_input("--frames", "DEM frames of the slurry, HDF5")
    parser.add_value("--first-frame", "number of the frame that the perturbed run starts from", type=int)
    parser.add_value("--target-frame", "number of the frame at which the perturbed run ends", type=int)
    parser.add_value("--displacement-um", "longest displacement of a coordinate, um", type=float)
    parser.add_value("--work", "work folder, from which a killed perturbed run goes on", type=Path)
    parser.add_lammps()
    parser.add_value(
        "--budget-min", "minutes in which to stop between two segments; 0: no limit", default=0, type=float
    )
    parser.add_output("--attempts", "folder for a log of each attempt", required=False)
    parser.add_output("--perturbed", "the perturbed run at the target frame, HDF5")
    parser.add_check(wrong_first_frame)


def wrong_first_frame(args: Namespace) -> str | None:
    """What is wrong with the first frame, if anything is."""
    first, target = args.first_frame, args.target_frame
    return None if 0 <= first < target else f"--first-frame {first}: must be from 0 to below --target-frame {target}"


def main(args: Namespace) -> None:
    """Run and write."""
    inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
    slurry, dem = inputs["slurry"], inputs["physics"]["dem"]
    frame_steps = steps_per_frame(dem)
    first, last = args.first_frame * frame_steps, args.target_frame * frame_steps
    ends = [segment["step_end"] for segment in json.loads(args.run.read_text(encoding="utf-8"))["segments"]]
    steps = [first, *(end for end in ends if first < end < last), last]
    displacement = {
        "restart": START,
        "from": first,
        "displacement_um": args.displacement_um,
        # "twin" is part of the seed: another word would give another run.
        "displacement_seed": derived_seed(inputs["physics"]["slurry"]["seed"], "twin"),
    }

    def check_displaced() -> None:
        """Refuse a restart file that is of another step, or whose contact history LAMMPS dropped."""
        log, displaced = args.work / "displace.log", args.work / f"step_{first}.restart"
        step = int(read_log(log).thermo[-1, 0])
        if step != first:
            raise InputError(f"{args.restart}: of step {step}, frame {args.first_frame} is {first}")
        refuse_lost_history(log, args.restart)
        check_restart(displaced)

    chain = Chain(
        f"{slurry} perturbed run",
        inputs,
        [Opening("displace", f"step_{first}.restart", displacement, check_displaced)],
        steps,
    )
    settings = json.dumps([steps, args.displacement_um])
    known_by = identity([args.restart, args.inputs, args.coefficients], LAMMPS_SCRIPTS, settings)
    attempts = attempt_log(args.attempts) if args.attempts else contextlib.nullcontext()
    with attempts as attempt, work_folder(args.work, known_by) as work:
        with read_frames(args.frames) as store:
            stop = Stop(chain.name, 60 * args.budget_min)
            shutil.copyfile(args.restart, args.work / START)
            shutil.copyfile(args.coefficients, args.work / COEFFICIENTS)
            logs = chain.run(work, attempt, Launcher(args.executable, args.launcher, args.ranks), stop)
            *_, end = read_dump(args.work / f"frames_{chain.steps[-1]}.dump")
            attributes = {
                **store.attributes,
                "stage": "perturbed",
                "first_frame": args.first_frame,
                "displacement_um": args.displacement_um,
                "lammps_version": logs[-1].version,
            }
            frame = as_frame(end, args.target_frame, dem["timestep_us"])
            write_frames(args.perturbed, store.particles, [frame], attributes)
        shutil.rmtree(args.work)
        print(f"[{slurry}] perturbed run from frame {args.first_frame} to {args.target_frame}")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
