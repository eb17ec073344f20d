"""Folders that fail: a disk that is full, one that is read-only, a work folder that vanishes under a running job."""

import contextlib
import os
import random
import re
import shutil
import subprocess
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from comparison import changed, differences
from project import CALL_LIMIT_S, Injection, Job, Project, snapshot

PAGE = 4096
ENOUGH = "size=4g"
READ_ONLY = (
    "run_slurry",
    "train_surrogate",
    "relax_slurry",
    "dry_slurry",
    "measure_density",
    "plot_density",
    "write_report",
)
# What is there when a work folder is removed: something to lose.
VANISHING = {
    "run_slurry": "segment_*.json",
    "relax_slurry": "push_off.log",
    "dry_slurry": "dry.log",
    "train_surrogate": "checkpoint.h5",
}


@contextlib.contextmanager
def own_disk(folder: Path) -> Iterator[bool]:
    """Put a disk in memory at `folder`, with what is there; False where that is not allowed."""
    aside = folder.with_name(f"{folder.name}_aside")
    folder.rename(aside)
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", ENOUGH, "tmpfs", folder]
    mounted = not subprocess.run(mount, capture_output=True).returncode
    try:
        if mounted:
            shutil.copytree(aside, folder, dirs_exist_ok=True)
        yield mounted
    finally:
        if mounted:
            subprocess.run(["umount", "--lazy", folder], check=True)
        folder.rmdir()
        aside.rename(folder)


def remount(folder: Path, options: str) -> None:
    """Change the disk at `folder`."""
    subprocess.run(["mount", "-o", f"remount,{options}", folder], check=True)


def leave(folder: Path, free: float) -> str:
    """Make the disk at `folder` so small that about `free` bytes are left; return them in words."""
    disk = os.statvfs(folder)
    pages = int(free) // PAGE
    remount(folder, f"size={(disk.f_blocks - disk.f_bfree) * disk.f_frsize + pages * PAGE}")
    return f"{pages * PAGE // 1024} KiB left"


def size_of(paths: Iterable[Path]) -> int:
    """Bytes that files take on the disk."""
    return sum(-(-path.stat().st_size // PAGE) * PAGE for path in paths if path.is_file())


def one_of_each_rule(jobs: Iterable[Job], draw: random.Random) -> list[Job]:
    """A job of each rule, drawn; of extract_frames the one whose dump the DEM before it has just written."""
    by_rule: dict[str, list[Job]] = {}
    for job in jobs:
        by_rule.setdefault(job.rule, []).append(job)
    chosen = {rule: draw.choice(same) for rule, same in by_rule.items()}
    for job in by_rule.get("extract_frames", ()):
        if job.wildcards == chosen["run_slurry"].wildcards:
            chosen["extract_frames"] = job
    return list(chosen.values())


def full_and_read_only(
    project: Project, reference: Path, jobs: Iterable[Job], seed: int, limit_s: float
) -> Iterator[Injection]:
    """On a disk of its own: a job of each rule finds it full, some find it read-only; all run when it is mended."""
    draw = random.Random(seed)
    with own_disk(project.results) as mounted:
        if not mounted:
            print("full disk: left out, only root may mount a disk in memory")
            return
        for work in list(project.results.rglob("work")):  # what is finished would not be done again
            shutil.rmtree(work)
        for job in one_of_each_rule(jobs, draw):
            for kind in ("full disk", *(["read-only folder"] if job.rule in READ_ONLY else [])):
                if time.monotonic() > limit_s:
                    return
                (project.folder / job.log).write_text("")  # the room that it takes would be free for the job
                if kind == "full disk":
                    # in any case too little for the largest output, which is written beside its place
                    largest = max(size_of([project.folder / name]) for name in job.outputs)
                    how = leave(project.results, draw.random() * (largest - PAGE))
                else:
                    remount(project.results, "ro")
                    how = "mounted read-only"
                injection = failing(project, job, kind, how)
                remount(project.results, f"rw,{ENOUGH}")
                injection.lost = "; ".join(filter(None, [injection.lost, *succeeding(project, reference, job)]))
                yield injection


def growing(project: Project, reference: Path, seed: int, limit_s: float) -> Iterator[Injection]:
    """The whole workflow on a disk that is too small, a larger one each time, at last one that is large enough."""
    draw = random.Random(seed)
    models = size_of(reference.glob("models/*/*"))
    others = size_of(reference.rglob("*")) - models
    sizes = [*sorted(others * draw.uniform(0.05, 0.9) for _ in range(3)), others + models * draw.uniform(0.1, 0.9)]
    with own_disk(project.results) as mounted:
        if not mounted or time.monotonic() > limit_s:
            return
        for item in project.results.iterdir():
            shutil.rmtree(item) if item.is_dir() else item.unlink()
        done = []
        for size in sizes:
            remount(project.results, f"size={int(size) // PAGE * PAGE}")
            with project.started() as snakemake:
                code = snakemake.wait(CALL_LIMIT_S)
            said = project.said_last()
            rules = dict.fromkeys(re.findall(r"^Error in rule (\w+):", said, re.MULTILINE))
            errors = re.findall(r"^error: .+", said, re.MULTILINE)
            injection = Injection("full disk", ", ".join(rules), "results folder", f"{size / 1e6:.1f} MB in all")
            injection.outcome = errors[0] if errors else f"exit code {code}"
            injection.lost = "no clear line" if code and not errors else ""
            done.append(injection)
        remount(project.results, ENOUGH)
        with project.started() as snakemake:
            code = snakemake.wait(CALL_LIMIT_S)
        lost = [f"the last call ended with {code}"] if code else differences(reference, project.results)
        for injection in done:
            injection.lost = "; ".join(filter(None, [injection.lost, *lost]))
        yield from done


def vanishing(project: Project, reference: Path, jobs: Iterable[Job], seed: int, limit_s: float) -> Iterator[Injection]:
    """Remove the work folder of a job that runs: one line, nothing else changed, and the next call finishes."""
    draw = random.Random(seed)
    for job in one_of_each_rule((job for job in jobs if job.rule in VANISHING), draw):
        if time.monotonic() > limit_s:
            return
        work = project.folder / job.option("work")
        shutil.rmtree(work, ignore_errors=True)
        before = snapshot(project.results)
        with project.begun(job.command) as process:
            while process.poll() is None and not list(work.glob(VANISHING[job.rule])):
                time.sleep(0.01)
            shutil.rmtree(work, ignore_errors=True)
            said, _ = process.communicate(timeout=CALL_LIMIT_S)
        kind, how = "vanished work folder", "while it ran"
        if process.returncode:
            injection = judged(project, job, kind, how, before, process.returncode, said)
        else:  # it had no need of what was there
            injection = Injection(kind, job.rule, "results folder", how, "it ended all the same")
        injection.lost = "; ".join(filter(None, [injection.lost, *succeeding(project, reference, job)]))
        yield injection


def failing(project: Project, job: Job, kind: str, how: str) -> Injection:
    """Run a job that cannot write."""
    before = snapshot(project.results)
    done = project.do(job)
    return judged(project, job, kind, how, before, done.returncode, done.stdout)


def judged(
    project: Project, job: Job, kind: str, how: str, before: Mapping[str, tuple], code: int, said: str
) -> Injection:
    """A job that has to fail with one line that gives the reason, and to leave all outputs as they were."""
    errors = [line for line in said.splitlines() if line.startswith("error: ")]
    after = snapshot(project.results)
    gone = [name for name in before if before[name] != after.get(name) and "/work/" not in name]
    lost = ["exit code 0"] if not code else []
    lost += [f"{len(errors)} lines of error"] if len(errors) != 1 or "Traceback" in said else []
    lost += [f"changed: {', '.join(gone)}"] if gone else []
    outcome = errors[0] if errors else str(said.splitlines()[-1:])
    return Injection(kind, job.rule, "results folder", how, outcome, "; ".join(lost))


def succeeding(project: Project, reference: Path, job: Job) -> list[str]:
    """Run a job again that failed; return what is wrong with its outputs."""
    done = project.do(job)
    lost = [f"exit code {done.returncode} afterwards: {done.stdout.splitlines()[-1:]}"] if done.returncode else []
    return [*lost, *changed(reference, project.results, project.inside(job.outputs))]
