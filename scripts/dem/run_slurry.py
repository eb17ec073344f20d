"""Run the DEM of one slurry: overlaps pushed off, then a chain of segments under pressure until it is equilibrated.

In: what generate_inputs.py wrote.
Out: the frames as one LAMMPS dump (um), a restart file for each restart frame, the logs, the thermo table as CSV (us,
g/cm3, kPa, K, um) and a JSON summary: physics, LAMMPS version, ranks, and the cost of each segment.

The work folder holds the restart file of each finished segment: a run that was killed goes on from the last one that is
undamaged when it is started again with the same inputs, and ends with the same numbers. A run that stops on purpose, at
the end of its budget or on SIGTERM or SIGUSR1, ends with exit code 75.

The work folder stays until extract_frames.py has the frames: a workflow that is killed before it has taken note of the
outputs asks for them again.
"""

import itertools
import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from slurrycast.dem.chain import Chain, Opening, boundaries, identity
from slurrycast.dem.lammps_log import Log
from slurrycast.dem.lammps_run import Launcher, steps_per_frame
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import moved_into_place, write_text
from slurrycast.runtime.stopping import Stop
from slurrycast.runtime.work_folder import attempt_log, work_folder

LAMMPS_SCRIPTS = ("push_off.lmp", "start.lmp", "slurry.lmp")
THERMO_COLUMNS = {
    "Step": "step",
    "v_time_us": "time_us",
    "v_density_g_cm3": "density_g_cm3",
    "Press": "pressure_kpa",
    "Temp": "temperature_k",
    "v_temperature_rotational_k": "temperature_rotational_k",
    "c_mean_contacts": "mean_contacts",
    "Lx": "lx_um",
    "Ly": "ly_um",
    "Lz": "lz_um",
}


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--inputs", "JSON of generate_inputs.py")
    parser.add_input("--data", "LAMMPS data file")
    parser.add_input("--coefficients", "pair_coeff lines of the real forces")
    parser.add_input("--push-off", "pair_coeff lines of the soft push-off")
    parser.add_value("--last-frame", "number of the frame at which the run ends", type=int)
    parser.add_value("--restart-frames", "frames at which a restart file is kept", type=int, nargs="+")
    parser.add_value("--work", "work folder, from which a killed run goes on", type=Path)
    parser.add_lammps()
    parser.add_value(
        "--budget-min", "minutes in which to stop between two segments; 0: no limit", default=0, type=float
    )
    parser.add_output("--attempts", "folder for a log of each attempt")
    parser.add_output("--dump", "all frames, LAMMPS text dump")
    parser.add_output("--restarts", "folder for frame_<k>.restart, k as --restart-frames")
    parser.add_output("--thermo", "thermo table, CSV")
    parser.add_output("--log", "the logs of all LAMMPS processes, one after the other")
    parser.add_output("--run", "summary, JSON")
    parser.add_output("--cost", "cost record, JSON")
    parser.add_check(wrong_restart_frames)


def wrong_restart_frames(args: Namespace) -> str | None:
    """What is wrong with the restart frames, if anything is."""
    outside = [frame for frame in args.restart_frames if not 0 < frame <= args.last_frame]
    return f"--restart-frames {outside[0]}: must be from 1 to --last-frame {args.last_frame}" if outside else None


def cuts(args: Namespace, dem: Mapping) -> list[int]:
    """Steps at which the run is cut; also where an earlier attempt was, so that what it finished counts."""
    frame_steps = steps_per_frame(dem)
    found = [int(record.stem.removeprefix("segment_")) // frame_steps for record in args.work.glob("segment_*.json")]
    return boundaries(frame_steps, args.last_frame, dem["segment_frames"], [*args.restart_frames, *found])


def thermo_table(logs: Sequence[Log]) -> np.ndarray:
    """Rows of THERMO_COLUMNS of all segments; the first row of a segment repeats the last one of the segment before."""
    tables = [log.thermo[:, [log.columns.index(name) for name in THERMO_COLUMNS]] for log in logs]
    return np.concatenate([tables[0], *(table[1:] for table in tables[1:])])


def main(args: Namespace) -> None:
    """Run, summarise, move the outputs into place."""
    inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
    slurry, dem = inputs["slurry"], inputs["physics"]["dem"]
    variables = {
        "data": "initial.data",
        "push_off": "push_off.lmp",
        "push_off_iterations": dem["push_off_iterations"],
        "velocity_seed": inputs["seeds"]["velocities"],
    }
    openings = [Opening("push_off", "pushed_off.data", variables), Opening("start", "step_0.restart", variables)]
    launcher = Launcher(args.executable, args.launcher, args.ranks)
    files = [args.inputs, args.data, args.coefficients, args.push_off]
    with (
        attempt_log(args.attempts) as attempt,
        work_folder(args.work, identity(files, LAMMPS_SCRIPTS)) as work,
        measured_cost(args.cost, "run_slurry", slurry=slurry) as cost,
    ):
        stop = Stop(slurry, 60 * args.budget_min)
        steps = cuts(args, dem)
        for name, file in zip(("initial.data", "coefficients.lmp", "push_off.lmp"), files[1:], strict=True):
            shutil.copyfile(file, work.path / name)
        chain = Chain(slurry, inputs, openings, steps)
        logs = chain.run(work, attempt, launcher, stop, cost)
        spent = {part: work.cost(part) for part in chain.parts}

        with moved_into_place(args.dump) as part, part.open("wb") as whole:
            for last in steps[1:]:
                with (work.path / f"frames_{last}.dump").open("rb") as segment:
                    shutil.copyfileobj(segment, whole, 1 << 20)
        for frame in args.restart_frames:
            with moved_into_place(args.restarts / f"frame_{frame}.restart") as part:
                shutil.copyfile(work.path / f"step_{frame * steps_per_frame(dem)}.restart", part)
        with moved_into_place(args.log) as part, part.open("wb") as whole:
            for name in chain.parts:
                whole.write((work.path / f"{name}.log").read_bytes())
        thermo = thermo_table(logs)
        with moved_into_place(args.thermo) as part:
            # without pandas, which takes longer to load than a segment to start
            formats = ["%d", *["%.10g"] * (len(THERMO_COLUMNS) - 1)]
            np.savetxt(part, thermo, formats, delimiter=",", header=",".join(THERMO_COLUMNS.values()), comments="")
        summary = {
            "slurry": slurry,
            "particles": inputs["particles"],
            "steps": steps[-1],
            "frames_written": args.last_frame + 1,
            "lammps_version": logs[-1].version,
            "ranks": args.ranks,
            "physics": inputs["physics"],
            "start": {clock: sum(spent[opening.part][clock] for opening in openings) for clock in ("wall_s", "cpu_s")},
            "segments": [
                {"step_start": first, "step_end": last, **spent[f"segment_{last}"]}
                for first, last in itertools.pairwise(steps)
            ],
        }
        write_text(args.run, json.dumps(summary, indent=1) + "\n")
        cost.particles, cost.steps = inputs["particles"], steps[-1]
        last = dict(zip(THERMO_COLUMNS.values(), thermo[-1], strict=True))
        print(f"[{slurry}] done: {last['density_g_cm3']:.4f} g/cm3 at {last['time_us']:g} us")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
