"""Cut files and flipped bits: what is damaged between two stages is refused by name, what is damaged in a work folder
is done again."""

import contextlib
import itertools
import os
import random
import re
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from comparison import changed
from project import CALL_LIMIT_S, Injection, Job, Project, snapshot

WAYS = ("cut", "flipped bit")
WORK_FILES = ("step_*.restart", "frames_*.dump", "segment_*.log", "segment_*.json")  # of the DEM


def damage(path: Path, way: str, draw: random.Random) -> str:
    """Cut a file or flip a bit; return how. Its time stays, as on a disk that fails: nothing is made anew for it."""
    data, state = path.read_bytes(), path.stat()
    place = draw.randrange(len(data))
    if way == "cut":
        path.write_bytes(data[:place])
        said = f"cut to {place} of {len(data)} bytes"
    else:
        bit = draw.randrange(8)
        path.write_bytes(data[:place] + bytes([data[place] ^ 1 << bit]) + data[place + 1 :])
        said = f"bit {bit} of byte {place} flipped"
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))
    return said


@contextlib.contextmanager
def damaged(path: Path, way: str, draw: random.Random) -> Iterator[str]:
    """Damage a file for the block; yield how."""
    sound, state = path.read_bytes(), path.stat()
    try:
        yield damage(path, way, draw)
    finally:
        path.write_bytes(sound)
        os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))


def kind_of(name: str, producer: Job) -> str:
    """Name of a file with the ids of its slurry and surrogate left open."""
    for wildcard, value in producer.wildcards.items():
        name = re.sub(rf"(?<=[/_])(?<!/frame_){re.escape(value)}(?=[/._]|$)", f"<{wildcard}>", name)
    return name.removeprefix("results/tiny/")


def readings(project: Project, jobs: Iterable[Job], draw: random.Random) -> dict[str, list[tuple[str, Job]]]:
    """For each kind of file, one example for each rule that reads it."""
    jobs = list(jobs)
    producers = {name: job for job in jobs for name in job.outputs}
    found: dict[tuple[str, str], list[tuple[str, Job]]] = {}
    for job in jobs:
        for name in job.reads:
            if (project.folder / name).is_file():
                found.setdefault((kind_of(name, producers.get(name, job)), job.rule), []).append((name, job))
    examples: dict[str, list[tuple[str, Job]]] = {}
    for (kind, _), pairs in found.items():
        examples.setdefault(kind, []).append(draw.choice(pairs))
    return examples


def refused(project: Project, jobs: Iterable[Job], seed: int, limit_s: float, number: int | None = None):
    """Damage each kind of file in both ways and run what reads it, each rule at least once; yield an Injection each.

    At most `number`, drawn, if given.
    """
    draw = random.Random(seed)
    plan = []
    for kind, examples in readings(project, jobs, draw).items():
        turns = max(len(examples), len(WAYS))
        pairs = zip(itertools.cycle(examples), itertools.cycle(WAYS), range(turns), strict=False)
        plan += [(kind, *example, way) for example, way, _ in pairs]
    if number is not None:
        plan = draw.sample(plan, min(number, len(plan)))
    for kind, name, job, way in plan:
        if time.monotonic() > limit_s:
            return
        with damaged(project.folder / name, way, draw) as how:
            before = snapshot(project.results)
            done = project.do(job)
            touched = sorted(set(before.items()) ^ set(snapshot(project.results).items()))
        injection = Injection("damaged file", job.rule, kind, f"{how} of {name.removeprefix('results/tiny/')}")
        lines = done.stdout.splitlines()
        injection.outcome = "refused by name in one line" if len(lines) == 1 and name in lines[0] else str(lines[-1:])
        lost = []
        if not done.returncode:
            lost.append("not noticed")
        elif len(lines) != 1 or name not in lines[0]:
            lost.append(f"said in {len(lines)} lines")
        if touched:
            lost.append(f"changed: {', '.join(sorted({name for name, _ in touched}))}")
        injection.lost = "; ".join(lost)
        yield injection


def redone(project: Project, reference: Path, jobs: Iterable[Job], seed: int, limit_s: float) -> Iterator[Injection]:
    """Damage what a DEM or a training that was cut off has left in its work folder, and run it again."""
    draw = random.Random(seed)
    dem = min((job for job in jobs if job.rule == "run_slurry"), key=lambda job: int(job.option("last-frame")))
    project.shell(dem.command, check=True)
    work = project.folder / dem.option("work")
    for pattern, way in itertools.product(WORK_FILES, WAYS):
        if time.monotonic() > limit_s:
            return
        path = draw.choice(sorted(work.glob(pattern)))
        yield done_again(project, reference, dem, path, pattern, way, draw)
    training = [job for job in jobs if job.rule == "train_surrogate"]
    for job, way in itertools.product(training[:1], WAYS):
        if time.monotonic() > limit_s:
            return
        path = project.folder / job.option("work") / "checkpoint.h5"
        for left in path.parent.glob("*"):  # of the training that is finished
            if left.is_file():
                left.unlink()
        cut_off(project, job, path)
        yield done_again(project, reference, job, path, "checkpoint.h5", way, draw)


def cut_off(project: Project, job: Job, path: Path) -> None:
    """Run a job until `path` is there, and kill it."""
    with project.begun(job.command) as process:
        start = time.monotonic()
        while process.poll() is None and not path.exists():
            if time.monotonic() - start > CALL_LIMIT_S:
                raise RuntimeError(f"{path} does not come")
            time.sleep(0.05)
    if not path.exists():
        raise RuntimeError(f"{path} is not there after: {process.stdout.read()}")


def done_again(
    project: Project, reference: Path, job: Job, path: Path, kind: str, way: str, draw: random.Random
) -> Injection:
    """Damage a file of a work folder and run the job: it has to say so, and to end with the same results."""
    how = damage(path, way, draw)
    done = project.do(job)
    injection = Injection("damaged work folder", job.rule, kind, f"{how} of {path.name} of {path.parents[1].name}")
    said = [line for line in done.stdout.splitlines() if path.name in line]
    injection.outcome = "said so, done again" if said else "not noticed"
    lost = [f"exit code {done.returncode}: {done.stdout.splitlines()[-1:]}"] if done.returncode else []
    lost += changed(reference, project.results, project.inside(job.outputs))
    injection.lost = "; ".join(lost if said else ["not noticed", *lost])
    return injection
