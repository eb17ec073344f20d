"""SIGKILL at seeded random moments, the same command again, and a comparison with an undisturbed run at the end."""

import contextlib
import math
import random
import re
import shutil
import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil
from comparison import differences
from project import CALL_LIMIT_S, Injection, Project, end

STAGES = {
    stage: rules.split()
    for stage, rules in {
        "DEM": "generate_inputs run_slurry",
        "extraction": "extract_frames",
        "data set": "assemble_dataset measure_packing",
        "training": "train_surrogate fit_surrogate",
        "prediction": "predict_slurry",
        "relaxation": "wrap_slurry relax_slurry",
        "analysis": "measure_equilibrium measure_density compute_rdf compare_coordinates compare_rdf collect_costs"
        " compare_costs",
        "report": "record_run draw_rules plot_workflow plot_densification plot_learning_curves plot_coordinates"
        " plot_density plot_rdf plot_costs write_report",
    }.items()
}
STAGE_OF = {rule: stage for stage, rules in STAGES.items() for rule in rules}
WITH_LAMMPS = ("DEM", "relaxation")
# The driver of a job, Snakemake itself so that its jobs go on, all at once, LAMMPS.
VICTIMS = ("driver", "Snakemake", "all processes", "LAMMPS")
KILLS_PER_ROUND = 13
POLL_S = 0.03
EXTRA_ROUNDS = 2  # for kills whose moment never came


@dataclass
class Kill:
    """A planned kill: of whom, and when, as a share of the time that the stage takes undisturbed."""

    stage: str
    victim: str
    share: float


@dataclass(frozen=True)
class Running:
    """A process of a job."""

    rule: str
    victim: str
    process: psutil.Process


def planned(seed: int, number: int, stages: Collection[str]) -> list[Kill]:
    """Draw kills: each victim in each of the stages where it lives, shuffled, as often as needed."""
    draw = random.Random(seed)
    plan = []
    while len(plan) < number:
        kinds = [(stage, victim) for stage in stages for victim in VICTIMS[: 4 if stage in WITH_LAMMPS else 3]]
        plan += draw.sample(kinds, len(kinds))
    return [Kill(stage, victim, draw.random()) for stage, victim in plan[:number]]


def running(snakemake: psutil.Process) -> list[Running]:
    """Scripts that a call of Snakemake is running, and LAMMPS where they started it."""
    found = []
    with contextlib.suppress(psutil.NoSuchProcess):
        for process in snakemake.children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):
                words = process.cmdline()
                if len(words) > 1 and (script := re.fullmatch(r"scripts/(\w+)\.py", words[1])):
                    found.append(Running(script[1], "driver", process))
                elif process.name() == "lmp":
                    rules = [job.rule for job in found if job.process.pid in {p.pid for p in process.parents()}]
                    found += [Running(rule, "LAMMPS", process) for rule in rules[:1]]
    return found


def undisturbed(project: Project, *arguments: str) -> dict[str, float]:
    """Run the workflow to its end; return how many seconds each stage took, from its first job to its last."""
    seen: dict[str | None, list[float]] = {}
    with project.started(*arguments) as snakemake:
        while snakemake.poll() is None:
            for job in running(snakemake):
                seen.setdefault(STAGE_OF.get(job.rule), []).append(time.monotonic())
            time.sleep(POLL_S)
        if snakemake.wait():
            raise RuntimeError(f"the undisturbed run failed, see {project.log}")
    return {stage: seen[stage][-1] - seen[stage][0] for stage in STAGES if stage in seen}


def torture(
    project: Project, reference: Path, spans_s: dict[str, float], plan: Sequence[Kill], seed: int, limit_s: float
) -> Iterator[Injection]:
    """Kill as planned, in rounds from nothing to the report; yield an Injection for each kill that took place.

    A kill whose moment never came, as the stage was over before, is tried again in the next round at half the time.
    None is begun after `limit_s` (of time.monotonic), but a round that is begun is finished.
    """
    draw = random.Random(seed)
    n_rounds = math.ceil(len(plan) / KILLS_PER_ROUND)
    rounds = [list(plan[number::n_rounds]) for number in range(n_rounds)] + [[] for _ in range(EXTRA_ROUNDS)]
    for this, following in zip(rounds, [*rounds[1:], []], strict=True):
        if not this or time.monotonic() > limit_s:
            continue
        shutil.rmtree(project.results, ignore_errors=True)
        done: list[Injection] = []
        for kill in sorted(this, key=lambda kill: (list(STAGES).index(kill.stage), kill.share)):
            if time.monotonic() > limit_s:
                break
            injection = call(project, done[-1:], kill, spans_s[kill.stage], draw)
            if injection:
                done.append(injection)
            else:
                following.append(Kill(kill.stage, kill.victim, kill.share / 2))
        call(project, done[-1:])
        left = project.outlived()
        lost = [*([f"still running: {left}"] if left else []), *differences(reference, project.results)]
        for injection in done:  # any of them may have been the cause
            injection.lost = "; ".join(filter(None, [injection.lost, *lost]))
        yield from done


def call(
    project: Project,
    previous: Sequence[Injection],
    kill: Kill | None = None,
    span_s: float = 0.0,
    draw: random.Random | None = None,
) -> Injection | None:
    """Run the workflow as a user does again and again; kill when it is time. None if the time never came.

    The `previous` injection learns what its kill has cost: where the DEM went on, and whether this call failed.
    """
    steps, attempts = finished_steps(project.results), attempt_logs(project.results)
    locks = project.folder / ".snakemake" / "locks"
    if locks.is_dir() and any(locks.iterdir()):
        project.run("--unlock")  # after a kill of Snakemake, as docs/reliability.md says
    injection = None
    with project.started() as snakemake:
        if kill:
            injection = inject(project, snakemake, kill, span_s, draw)
        try:
            code = snakemake.wait(CALL_LIMIT_S)
        except psutil.TimeoutExpired:
            code = "no exit code: it hangs"
    if code and not injection and "in use by" in project.said_last():
        # An orphan holds a lock for long: it is named, and a user waits for it.
        for earlier in previous:
            earlier.outcome += ", refused while an orphan was at work"
        project.outlived()
        return call(project, previous, kill, span_s, draw)
    lost = [f"the call ended with {code}"] if code and not injection else []
    resumed = []
    for log in sorted(attempt_logs(project.results) - attempts):
        start = re.search(r"goes on from step (\d+)", log.read_text(encoding="utf-8"))
        first, finished = int(start[1]) if start else 0, steps.get(log.parent.name, 0)
        resumed += [f"DEM of {log.parent.name} went on from step {first}"] * (first > 0)
        lost += [f"DEM of {log.parent.name} begun at step {first} of {finished} finished"] * (first < finished)
    for earlier in previous:
        earlier.outcome = ", ".join([earlier.outcome, *resumed])
        earlier.lost = "; ".join(lost)
    if lost and not previous:
        raise RuntimeError(f"nothing was killed, but {lost}: see {project.log}")
    if injection:
        injection.outcome = {0: "no job failed", 1: "the job failed"}.get(code, "Snakemake ended")
    return injection


def inject(
    project: Project, snakemake: psutil.Popen, kill: Kill, span_s: float, draw: random.Random
) -> Injection | None:
    """Wait for the moment and kill; None if Snakemake ends before."""
    began_s = None  # the stage, in this call
    while snakemake.poll() is None:
        jobs = [job for job in running(snakemake) if STAGE_OF.get(job.rule) == kill.stage]
        if jobs and began_s is None:
            began_s = time.monotonic()
        candidates = [job for job in jobs if job.victim == ("LAMMPS" if kill.victim == "LAMMPS" else "driver")]
        if candidates and (after_s := time.monotonic() - began_s) >= kill.share * span_s:
            chosen = draw.choice(candidates)
            if kill.victim == "Snakemake":
                end([snakemake])
            elif kill.victim == "all processes":
                end([snakemake, *snakemake.children(recursive=True)])
                end(project.processes())  # what they have started meanwhile
            else:
                end([chosen.process])
            return Injection("kill", kill.stage, kill.victim, f"{after_s:.2f} s into the stage, amid {chosen.rule}")
        time.sleep(POLL_S)
    return None


def attempt_logs(results: Path) -> set[Path]:
    """Logs of the attempts at the DEM of all slurries."""
    logs = (results / "logs" / "run_slurry").glob("*/attempt_*.log")
    return {log for log in logs if re.fullmatch(r"attempt_\d+", log.stem)}


def finished_steps(results: Path) -> dict[str, float]:
    """How far the DEM of each slurry is: the step at which its last finished segment ends; infinity with its frames."""
    steps: dict[str, float] = {}
    for record in (results / "dem").glob("*/work/segment_*.json"):
        slurry = record.parts[-3]
        steps[slurry] = max(steps.get(slurry, 0), int(record.stem.removeprefix("segment_")))
    for frames in (results / "frames").glob("*.h5"):
        if not (results / "dem" / frames.stem / "work").exists():
            steps[frames.stem] = math.inf
    return steps
