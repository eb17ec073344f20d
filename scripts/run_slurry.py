"""Run the DEM of one slurry: overlaps pushed off, then a chain of segments under pressure until it is equilibrated.

In: what generate_inputs.py wrote.
Out: the frames as one LAMMPS dump (um), a restart file for each restart frame, the logs, the thermo table as CSV (us,
g/cm3, kPa, K, um) and a JSON summary: physics, LAMMPS version, ranks, and the cost of each segment.

The work folder holds the restart file of each finished segment: a run that was killed goes on from the last one when it
is started again with the same inputs, and ends with the same numbers. It is removed when all outputs are in place.
"""

import argparse
import hashlib
import json
import shutil
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import pandas as pd

from slurrycast.costs import children_cpu_s, measured_cost
from slurrycast.files import moved_into_place, run_main, write_text
from slurrycast.lammps_log import Log, read_log
from slurrycast.lammps_run import SCRIPTS, Launcher, Progress, force_field_variables, run_lammps, steps_per_frame

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


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", required=True, help="in: JSON of generate_inputs.py")
    parser.add_argument("--data", required=True, help="in: LAMMPS data file")
    parser.add_argument("--coefficients", required=True, help="in: pair_coeff lines of the real forces")
    parser.add_argument("--push-off", required=True, help="in: pair_coeff lines of the soft push-off")
    parser.add_argument("--last-frame", required=True, type=int, help="number of the frame at which the run ends")
    parser.add_argument("--work", required=True, type=Path, help="work folder, from which a killed run goes on")
    parser.add_argument("--executable", default="lmp", help="LAMMPS: a name on PATH or a path")
    parser.add_argument("--launcher", default="mpiexec", help="put before the executable when ranks > 1")
    parser.add_argument("--ranks", default=1, type=int, help="MPI ranks")
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


def prepare_work(work: Path, inputs: Sequence[Path]) -> None:
    """Fill the work folder; one that was made from other inputs or other LAMMPS scripts is emptied first."""
    files = [*inputs, *(SCRIPTS / name for name in LAMMPS_SCRIPTS)]
    identity = hashlib.sha256(b"".join(hashlib.sha256(file.read_bytes()).digest() for file in files)).hexdigest()
    marker = work / "identity"
    if work.exists() and not (marker.exists() and marker.read_text() == identity):
        print(f"{work}: left by a run with other inputs; starting anew")
        shutil.rmtree(work)
    work.mkdir(parents=True, exist_ok=True)
    for name, file in zip(("initial.data", "coefficients.lmp", "push_off.lmp"), inputs[1:], strict=True):
        shutil.copyfile(file, work / name)
    write_text(marker, identity)


def thermo_table(logs: Sequence[Log]) -> pd.DataFrame:
    """One table of all segments; the first row of a segment repeats the last one of the segment before."""
    tables = [pd.DataFrame(log.thermo, columns=log.columns).iloc[min(index, 1) :] for index, log in enumerate(logs)]
    table = pd.concat(tables, ignore_index=True)[list(THERMO_COLUMNS)].rename(columns=THERMO_COLUMNS)
    return table.astype({"step": int})


def run_recorded(launcher: Launcher, script: str, variables: dict, work: Path, name: str, *progress: Progress) -> Log:
    """Run LAMMPS and leave what it cost beside its log: the mark, for a later attempt, that it finished well."""
    wall_s, cpu_s = time.perf_counter(), children_cpu_s()
    log = run_lammps(launcher, script, variables, work, f"{name}.log", *progress)
    spent = {"wall_s": time.perf_counter() - wall_s, "cpu_s": children_cpu_s() - cpu_s}
    write_text(work / f"{name}.json", json.dumps(spent))
    return log


def recorded_cost(work: Path, name: str) -> dict[str, float]:
    """What a LAMMPS process cost."""
    return json.loads((work / f"{name}.json").read_text())


def run_segments(work: Path, inputs: dict, steps: Sequence[int], launcher: Launcher) -> list[Log]:
    """Run the segments between `steps` that the work folder does not hold yet; return the logs of all."""
    dem, name = inputs["physics"]["dem"], inputs["slurry"]
    variables = {
        **force_field_variables(inputs["physics"]["force_field"], dem),
        "data": "initial.data",
        "coefficients": "coefficients.lmp",
        "push_off": "push_off.lmp",
        "push_off_iterations": dem["push_off_iterations"],
        "velocity_seed": inputs["seeds"]["velocities"],
        "thermo_every_steps": dem["thermo_every_steps"],
        "frame_every_steps": steps_per_frame(dem),
    }
    if not (work / "start.json").exists():
        run_recorded(launcher, "push_off.lmp", variables, work, "push_off")
        run_recorded(launcher, "start.lmp", variables, work, "start")
    # Not by the restart file: it is there before the log is complete.
    done = max((to for to in steps if (work / f"segment_{to}.json").exists()), default=0)
    if done:
        print(f"[{name}] goes on from step {done} of {steps[-1]}")
    progress = Progress(name, done, steps[-1], print)
    logs = []
    for first, last in pairwise(steps):
        segment = f"segment_{last}"
        if last <= done:
            logs.append(read_log(work / f"{segment}.log"))
        else:
            ends = {**variables, "from": first, "to": last}
            logs.append(run_recorded(launcher, "slurry.lmp", ends, work, segment, progress))
    return logs


def main() -> None:
    """Run, summarise, move the outputs into place."""
    args = parse_args()
    inputs = json.loads(Path(args.inputs).read_text(encoding="utf-8"))
    dem = inputs["physics"]["dem"]
    with measured_cost(args.cost, "run_slurry", slurry=inputs["slurry"]) as cost:
        prepare_work(args.work, [Path(p) for p in (args.inputs, args.data, args.coefficients, args.push_off)])
        steps = boundaries(steps_per_frame(dem), args.last_frame, dem["segment_frames"], dem["restart_frames"])
        launcher = Launcher(args.executable, args.launcher, args.ranks)
        for record in args.work.glob("*.json"):  # of earlier attempts, from which this one goes on
            earlier = json.loads(record.read_text(encoding="utf-8"))
            cost.wall_s += earlier["wall_s"]
            cost.cpu_s += earlier["cpu_s"]
        logs = run_segments(args.work, inputs, steps, launcher)

        with moved_into_place(args.dump) as part, part.open("wb") as whole:
            for last in steps[1:]:
                with (args.work / f"frames_{last}.dump").open("rb") as segment:
                    shutil.copyfileobj(segment, whole, 1 << 20)
        for frame in dem["restart_frames"]:
            if frame <= args.last_frame:
                with moved_into_place(args.restarts / f"frame_{frame}.restart") as part:
                    shutil.copyfile(args.work / f"step_{frame * steps_per_frame(dem)}.restart", part)
        with moved_into_place(args.log) as part, part.open("wb") as whole:
            for name in ("push_off", "start", *(f"segment_{last}" for last in steps[1:])):
                whole.write((args.work / f"{name}.log").read_bytes())
        thermo = thermo_table(logs)
        with moved_into_place(args.thermo) as part:
            thermo.to_csv(part, index=False, float_format="%.10g")
        segments = [
            {"step_start": first, "step_end": last, **recorded_cost(args.work, f"segment_{last}")}
            for first, last in pairwise(steps)
        ]
        summary = {
            "slurry": inputs["slurry"],
            "particles": inputs["particles"],
            "steps": steps[-1],
            "frames_written": args.last_frame + 1,
            "lammps_version": logs[-1].version,
            "ranks": args.ranks,
            "physics": inputs["physics"],
            "start": {
                clock: sum(recorded_cost(args.work, name)[clock] for name in ("push_off", "start"))
                for clock in ("wall_s", "cpu_s")
            },
            "segments": segments,
        }
        write_text(args.run, json.dumps(summary, indent=1) + "\n")
        cost.particles, cost.steps = inputs["particles"], steps[-1]
    shutil.rmtree(args.work)
    last = thermo.iloc[-1]
    print(f"[{inputs['slurry']}] done: {last.density_g_cm3:.4f} g/cm3 at {last.time_us:g} us")


if __name__ == "__main__":
    run_main(main)
