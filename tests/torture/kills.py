"""SIGKILL at seeded random moments, the same command again, and a comparison with an undisturbed run at the end."""

import contextlib
import math
import random
import re
import shutil
import statistics
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil

from comparison import differences
from project import CALL_LIMIT_S, Injection, Job, Project, end

STAGES = {
    stage: rules.split()
    for stage, rules in {
        "DEM": "generate_inputs run_slurry",
        "extraction": "extract_frames",
        "data set": "assemble_dataset measure_packing",
        "training": "train_surrogate fit_surrogate describe_model",
        "prediction": "predict_slurry",
        "relaxation": "wrap_slurry relax_slurry",
        "tape": "dry_slurry calibrate_drying measure_drying measure_microstructure tabulate_microstructure"
        " plot_drying plot_tape",
        "analysis": "measure_equilibrium measure_relaxation check_training_range measure_density compute_rdf"
        " compare_coordinates compare_rdf collect_costs compare_costs",
        "report": "record_run draw_rules plot_workflow plot_densification plot_learning_curves plot_coordinates"
        " plot_density plot_rdf plot_costs write_report",
    }.items()
}
STAGE_OF = {rule: stage for stage, rules in STAGES.items() for rule in rules}
WITH_LAMMPS = ("run_slurry", "relax_slurry", "dry_slurry", "calibrate_drying")
# The driver of a job, Snakemake itself so that its jobs go on, all at once, LAMMPS.
VICTIMS = ("driver", "Snakemake", "all processes", "LAMMPS")
KILLS_PER_ROUND = 13
POLL_S = 0.03
# Stages resumed are shorter than undisturbed ones: a later moment might never come, and the call would run to the end.
LONGEST_WAIT_S = 4.0
EXTRA_ROUNDS = 2  # for kills whose moment never came


@dataclass
class Kill:
    """A planned kill: of whom, and when, as a share of what is left of the stage."""

    stage: str
    victim: str
    share: float


@dataclass(frozen=True)
class Running:
    """A script of a job, and LAMMPS if it has started it."""

    rule: str
    driver: psutil.Process
    lammps: list[psutil.Process]


def victims_in(stage: str) -> tuple[str, ...]:
    """Whom one can kill there."""
    return VICTIMS if any(rule in WITH_LAMMPS for rule in STAGES[stage]) else VICTIMS[:3]


def planned(seed: int, number: int, stages: Collection[str]) -> list[Kill]:
    """Draw kills: each victim in each of the stages where it lives, shuffled, as often as needed."""
    draw = random.Random(seed)
    plan = []
    while len(plan) < number:
        kinds = [(stage, victim) for stage in stages for victim in victims_in(stage)]
        plan += draw.sample(kinds, len(kinds))
    return [Kill(stage, victim, draw.random()) for stage, victim in plan[:number]]


def running(snakemake: psutil.Process) -> list[Running]:
    """Scripts that a call of Snakemake is running."""
    found, others = {}, []
    with contextlib.suppress(psutil.NoSuchProcess):
        for process in snakemake.children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):
                words = process.cmdline()
                if len(words) > 1 and (script := re.fullmatch(r"scripts/\w+/(\w+)\.py", words[1])):
                    found[process.pid] = Running(script[1], process, [])
                elif process.name() == "lmp":
                    others.append(process)
    for process in others:
        with contextlib.suppress(psutil.NoSuchProcess):
            for parent in process.parents():
                if parent.pid in found:
                    found[parent.pid].lammps.append(process)
    return list(found.values())


def undisturbed(project: Project, *arguments: str) -> dict[str, float]:
    """Run the workflow to its end; return how many seconds a job of each rule took, the median."""
    seen: dict[tuple[str, int], list[float]] = {}
    with project.started(*arguments) as snakemake:
        while snakemake.poll() is None:
            for job in running(snakemake):
                seen.setdefault((job.rule, job.driver.pid), []).append(time.monotonic())
            time.sleep(POLL_S)
        if snakemake.wait():
            raise RuntimeError(f"the undisturbed run failed, see {project.log}")
    taken: dict[str, list[float]] = {}
    for (rule, _), times in seen.items():
        taken.setdefault(rule, []).append(times[-1] - times[0])
    return {rule: statistics.median(seconds) for rule, seconds in taken.items()}


@dataclass
class Torture:
    """Kills in rounds, each from nothing to the report; `typical_s` is the time of a job of each rule."""

    project: Project
    reference: Path
    jobs: Sequence[Job]
    typical_s: Mapping[str, float]
    seed: int

    def run(self, number: int, limit_s: float) -> Iterator[Injection]:
        """Kill `number` times, as planned; yield an Injection for each kill that took place, after its round.

        A kill whose moment never came is tried again in the next round, earlier. None is begun after `limit_s` (of
        time.monotonic), but a round that is begun is finished.
        """
        stages = [stage for stage in STAGES if any(STAGE_OF.get(job.rule) == stage for job in self.jobs)]
        plan = planned(self.seed, number, stages)
        n_rounds = math.ceil(number / KILLS_PER_ROUND)
        rounds = [plan[start::n_rounds] for start in range(n_rounds)] + [[] for _ in range(EXTRA_ROUNDS)]
        for this, following in zip(rounds, [*rounds[1:], []], strict=True):
            if not this or time.monotonic() > limit_s:
                continue
            shutil.rmtree(self.project.results, ignore_errors=True)
            done: list[Injection] = []
            left = sorted(this, key=lambda kill: (stages.index(kill.stage), kill.share))
            while left and time.monotonic() < limit_s:
                injection = self.call(done[-1:], left[0])
                if injection is None:  # and all is finished
                    following += [Kill(left[0].stage, left[0].victim, left[0].share / 2), *left[1:]]
                    break
                done.append(injection)
                left.pop(0)
            self.call(done[-1:])
            alive = self.project.outlived()
            lost = [f"still running: {alive}"] if alive else []
            lost += differences(self.reference, self.project.results)
            for injection in done:  # any of them may have been the cause
                injection.lost = "; ".join(filter(None, [injection.lost, *lost]))
            yield from done

    def call(self, previous: Sequence[Injection], kill: Kill | None = None) -> Injection | None:
        """Run the workflow as a user does again and again, and kill when it is time; None if the time never came.

        The `previous` injection learns what it has cost: where the DEM went on, and whether this call failed.
        """
        project, results = self.project, self.project.results
        steps, attempts = finished_steps(results), attempt_logs(results)
        locks = project.folder / ".snakemake" / "locks"
        if locks.is_dir() and any(locks.iterdir()):
            project.run("--unlock")  # after a kill of Snakemake, as docs/reliability.md says
        injection = None
        with project.started() as snakemake:
            if kill:
                injection = self.inject(snakemake, kill)
            try:
                code = snakemake.wait(CALL_LIMIT_S)
            except psutil.TimeoutExpired:
                code = "no exit code: it hangs"
        if code and not injection and "in use by" in project.said_last():
            # An orphan holds a lock for long: it is named, and a user waits for it.
            for earlier in previous:
                earlier.outcome += ", refused while an orphan was at work"
            project.outlived()
            return self.call(previous, kill)
        lost = [f"the call ended with {code}"] if code and not injection else []
        resumed = []
        for log in sorted(attempt_logs(results) - attempts):
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

    def inject(self, snakemake: psutil.Popen, kill: Kill) -> Injection | None:
        """Wait for the moment and kill; None if Snakemake ends before.

        The moment is a share of the jobs that are left of the stage: so many of them let pass, then a part of the next.
        """
        rules = [rule for rule in STAGES[kill.stage] if kill.victim != "LAMMPS" or rule in WITH_LAMMPS]
        left = [job for job in self.jobs if job.rule in rules and not self.project.made(job)]
        passed, part = divmod(kill.share * len(left), 1)
        seen: dict[int, float] = {}  # when a job began, by the pid of its driver
        while snakemake.poll() is None:
            for job in running(snakemake):
                if job.rule not in rules:
                    continue
                began_s = seen.setdefault(job.driver.pid, time.monotonic())
                age_s, number = time.monotonic() - began_s, list(seen).index(job.driver.pid)
                victims = {"LAMMPS": job.lammps, "driver": [job.driver]}.get(kill.victim, [snakemake])
                early = number < passed or (number == passed and age_s < part * self.typical_s[job.rule])
                if early or not victims:
                    continue
                if kill.victim == "all processes":
                    victims += snakemake.children(recursive=True)
                end(victims)
                if kill.victim == "all processes":
                    end(self.project.processes())  # what they have started meanwhile
                how = f"{age_s:.2f} s into {job.rule}, job {number + 1} of at most {max(len(left), number + 1)}"
                return Injection("kill", kill.stage, kill.victim, how)
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
