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

import argparse
import functools
import hashlib
import itertools
import json
import os
import shutil
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from slurrycast.command_line import Parser, input_file, run_main
from slurrycast.costs import children_cpu_s, measured_cost
from slurrycast.files import RunError, Unfinished, checksum, moved_into_place, write_text
from slurrycast.lammps_log import Log, read_log
from slurrycast.lammps_run import SCRIPTS, Launcher, Progress, force_field_variables, run_lammps, steps_per_frame
from slurrycast.stopping import Stop
from slurrycast.work_folder import WorkFolder, attempt_log, work_folder

LAMMPS_SCRIPTS = ("push_off.lmp", "start.lmp", "slurry.lmp")
DUMP_HEADER_LINES = 9  # of each frame, before its particles
RESTART_END = b"LammpS RestartT\0"  # the last bytes of a restart file
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


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument("--inputs", type=input_file, required=True, help="in: JSON of generate_inputs.py")
    parser.add_argument("--data", type=input_file, required=True, help="in: LAMMPS data file")
    parser.add_argument(
        "--coefficients", type=input_file, required=True, help="in: pair_coeff lines of the real forces"
    )
    parser.add_argument("--push-off", type=input_file, required=True, help="in: pair_coeff lines of the soft push-off")
    parser.add_argument("--last-frame", required=True, type=int, help="number of the frame at which the run ends")
    parser.add_argument("--work", required=True, type=Path, help="work folder, from which a killed run goes on")
    parser.add_argument("--executable", default="lmp", help="LAMMPS: a name on PATH or a path")
    parser.add_argument("--launcher", default="mpiexec", help="put before the executable when ranks > 1")
    parser.add_argument("--ranks", default=1, type=int, help="MPI ranks")
    parser.add_argument(
        "--budget-min", default=0, type=float, help="minutes in which to stop between two segments; 0: no limit"
    )
    parser.add_argument("--attempts", required=True, type=Path, help="out: folder for a log of each attempt")
    parser.add_argument("--dump", required=True, help="out: all frames, LAMMPS text dump")
    parser.add_argument(
        "--restarts", required=True, type=Path, help="out: folder for frame_<k>.restart, k as dem.restart_frames"
    )
    parser.add_argument("--thermo", required=True, help="out: thermo table, CSV")
    parser.add_argument("--log", required=True, help="out: the logs of all LAMMPS processes, one after the other")
    parser.add_argument("--run", required=True, help="out: summary, JSON")
    parser.add_argument("--cost", required=True, help="out: cost record, JSON")
    return parser.parse_args()


def boundaries(frame_steps: int, last_frame: int, segment_frames: int, restart_frames: Sequence[int]) -> list[int]:
    """Steps at which the segments of a run begin and end: every `segment_frames` frames and at each restart frame."""
    frames = {*range(0, last_frame, segment_frames), *restart_frames, last_frame}
    return [frame * frame_steps for frame in sorted(frames) if frame <= last_frame]


def identity(inputs: Sequence[Path]) -> str:
    """Of a run: digest of all that its numbers come from, its inputs and the LAMMPS scripts."""
    files = [*inputs, *(SCRIPTS / name for name in LAMMPS_SCRIPTS)]
    return hashlib.sha256("".join(map(checksum, files)).encode()).hexdigest()


def thermo_table(logs: Sequence[Log]) -> pd.DataFrame:
    """One table of all segments; the first row of a segment repeats the last one of the segment before."""
    tables = [pd.DataFrame(log.thermo, columns=log.columns).iloc[min(index, 1) :] for index, log in enumerate(logs)]
    table = pd.concat(tables, ignore_index=True)[list(THERMO_COLUMNS)].rename(columns=THERMO_COLUMNS)
    return table.astype({"step": int})


def run_part(
    work: WorkFolder,
    attempt: Path,
    part: str,
    files: Sequence[str],
    launcher: Launcher,
    script: str,
    variables: dict,
    said: Callable[[int, float], None] | None = None,
    check: Callable[[], None] = lambda: None,
) -> Log:
    """Run LAMMPS and record that this part is finished, with the `files` that it wrote and what it cost.

    `check` may refuse the files. The log of an earlier attempt at the part is kept beside that attempt's own.
    """
    log = f"{part}.log"
    if (work.path / log).exists():
        shutil.move(work.path / log, attempt.with_name(f"{attempt.stem}_found_{log}"))
    wall_s, cpu_s = time.perf_counter(), children_cpu_s()
    result = run_lammps(launcher, script, variables, work.path, log, said)
    check()
    spent = {"wall_s": time.perf_counter() - wall_s, "cpu_s": children_cpu_s() - cpu_s}
    work.record(part, [*files, log], spent)
    return result


def check_written(work: Path, last: int, n_frames: int, particles: int) -> None:
    """Refuse, with RunError, a segment whose frames or restart file are not complete: LAMMPS ignores a full disk."""
    frames, restart = work / f"frames_{last}.dump", work / f"step_{last}.restart"
    with frames.open("rb") as file:
        lines = sum(block.count(b"\n") for block in iter(lambda: file.read(1 << 20), b""))
    expected = n_frames * (particles + DUMP_HEADER_LINES)
    if lines != expected:
        raise RunError(f"{frames}: has {lines} lines of {expected}: LAMMPS could not write it whole; is the disk full?")
    with restart.open("rb") as file:
        file.seek(-min(len(RESTART_END), restart.stat().st_size), os.SEEK_END)
        if file.read() != RESTART_END:
            raise RunError(f"{restart}: has no end: LAMMPS could not write it whole; is the disk full?")


def run_segments(
    work: WorkFolder,
    attempt: Path,
    inputs: dict,
    steps: Sequence[int],
    launcher: Launcher,
    stop: Stop,
    done: Sequence[str],
) -> list[Log]:
    """Run the parts between `steps` that are not `done` yet; return the logs of all segments."""
    dem, name = inputs["physics"]["dem"], inputs["slurry"]
    frame_steps = steps_per_frame(dem)
    variables = {
        **force_field_variables(inputs["physics"]["force_field"], dem),
        "data": "initial.data",
        "coefficients": "coefficients.lmp",
        "push_off": "push_off.lmp",
        "push_off_iterations": dem["push_off_iterations"],
        "velocity_seed": inputs["seeds"]["velocities"],
        "thermo_every_steps": dem["thermo_every_steps"],
        "frame_every_steps": frame_steps,
    }
    segments = {f"segment_{last}": (first, last) for first, last in itertools.pairwise(steps)}
    done_steps = max((last for part, (_, last) in segments.items() if part in done), default=0)
    if done_steps:
        print(f"[{name}] goes on from step {done_steps} of {steps[-1]}")
    for part, file in (("push_off", "pushed_off.data"), ("start", "step_0.restart")):
        if part not in done:
            run_part(work, attempt, part, [file], launcher, f"{part}.lmp", variables)
    progress = Progress(name, done_steps, steps[-1], print)

    def said(step: int, density_g_cm3: float) -> None:
        stop.reached(step)
        progress(step, density_g_cm3)

    logs = []
    for part, (first, last) in segments.items():
        if part in done:
            logs.append(read_log(work.path / f"{part}.log"))
            continue
        stop.begin(first, last)
        ends = {**variables, "from": first, "to": last}
        files = [f"frames_{last}.dump", f"step_{last}.restart"]
        n_frames = (last - first) // frame_steps + (first == 0)
        check = functools.partial(check_written, work.path, last, n_frames, inputs["particles"])
        try:
            logs.append(run_part(work, attempt, part, files, launcher, "slurry.lmp", ends, said, check))
        except RunError as error:
            if stop.asked:  # a launcher passes the signal on, and LAMMPS ends by it
                raise Unfinished(f"[{name}] stopped by {stop.asked}: {error}") from error
            raise
    return logs


def main() -> None:
    """Run, summarise, move the outputs into place."""
    args = parse_args()
    inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
    slurry, dem = inputs["slurry"], inputs["physics"]["dem"]
    steps = boundaries(steps_per_frame(dem), args.last_frame, dem["segment_frames"], dem["restart_frames"])
    parts = ["push_off", "start", *(f"segment_{last}" for last in steps[1:])]
    launcher = Launcher(args.executable, args.launcher, args.ranks)
    files = [args.inputs, args.data, args.coefficients, args.push_off]
    with (
        attempt_log(args.attempts) as attempt,
        work_folder(args.work, identity(files)) as work,
        measured_cost(args.cost, "run_slurry", slurry=slurry) as cost,
    ):
        stop = Stop(slurry, 60 * args.budget_min)
        for name, file in zip(("initial.data", "coefficients.lmp", "push_off.lmp"), files[1:], strict=True):
            shutil.copyfile(file, work.path / name)
        # Not by the restart files: each is there before the log of its segment is complete.
        done = list(itertools.takewhile(work.finished, parts))
        for part in parts[len(done) :]:
            work.forget(part)
        logs = run_segments(work, attempt, inputs, steps, launcher, stop, done)
        spent = {part: work.cost(part) for part in parts}
        for part in done:  # by earlier attempts
            cost.wall_s += spent[part]["wall_s"]
            cost.cpu_s += spent[part]["cpu_s"]

        with moved_into_place(args.dump) as part, part.open("wb") as whole:
            for last in steps[1:]:
                with (work.path / f"frames_{last}.dump").open("rb") as segment:
                    shutil.copyfileobj(segment, whole, 1 << 20)
        for frame in dem["restart_frames"]:
            if frame <= args.last_frame:
                with moved_into_place(args.restarts / f"frame_{frame}.restart") as part:
                    shutil.copyfile(work.path / f"step_{frame * steps_per_frame(dem)}.restart", part)
        with moved_into_place(args.log) as part, part.open("wb") as whole:
            for name in parts:
                whole.write((work.path / f"{name}.log").read_bytes())
        thermo = thermo_table(logs)
        with moved_into_place(args.thermo) as part:
            thermo.to_csv(part, index=False, float_format="%.10g")
        summary = {
            "slurry": slurry,
            "particles": inputs["particles"],
            "steps": steps[-1],
            "frames_written": args.last_frame + 1,
            "lammps_version": logs[-1].version,
            "ranks": args.ranks,
            "physics": inputs["physics"],
            "start": {clock: sum(spent[part][clock] for part in parts[:2]) for clock in ("wall_s", "cpu_s")},
            "segments": [
                {"step_start": first, "step_end": last, **spent[f"segment_{last}"]}
                for first, last in itertools.pairwise(steps)
            ],
        }
        write_text(args.run, json.dumps(summary, indent=1) + "\n")
        cost.particles, cost.steps = inputs["particles"], steps[-1]
        last = thermo.iloc[-1]
        print(f"[{slurry}] done: {last.density_g_cm3:.4f} g/cm3 at {last.time_us:g} us")


if __name__ == "__main__":
    run_main(main)
