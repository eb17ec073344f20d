"""The workflow under test: a copy of it, its jobs, its processes, and what is injected into them."""

import contextlib
import os
import re
import shlex
import subprocess
import sys
import time
import uuid
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
from checkouts import copy_checkout
from slurrycast.runtime.environment import OF_SHELL_AND_PYTHON, isolate_libraries, remove

MARK = "SLURRYCAST_TORTURE"  # environment variable that all processes of a campaign inherit, orphans too
CALL_LIMIT_S = 900.0  # a call of Snakemake that takes longer hangs
ORPHAN_LIMIT_S = 90.0  # orphans that live longer were left behind


@dataclass
class Injection:
    """One thing that was done to the workflow, and what became of it; a row of the table."""

    kind: str
    stage: str
    target: str  # the process that was killed, the file that was damaged, the folder that was full
    how: str
    outcome: str = ""
    lost: str = ""  # what was lost; nothing if empty


@dataclass(frozen=True)
class Job:
    """A job as Snakemake plans it."""

    rule: str
    wildcards: Mapping[str, str]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    command: str

    @property
    def reads(self) -> list[str]:
        """Files of the results that its command is given: declared inputs, and restart files, which nobody declares."""
        words = [word.rpartition("=")[2] for word in shlex.split(self.command)]
        read = {*self.inputs, *(word for word in words if word.endswith(".restart"))} - {*self.outputs}
        return [word for word in dict.fromkeys(words) if word.startswith("results/") and word in read]

    @property
    def log(self) -> str:
        """Where its command puts what it prints."""
        return shlex.split(self.command)[-1]

    def option(self, name: str) -> str:
        """Value of an option of its command."""
        words = shlex.split(self.command)
        return words[words.index(f"--{name}") + 1]


@dataclass
class Project:
    """A copy of the workflow in `folder` that makes `target` of the tiny configuration with `overlay` laid over it."""

    folder: Path
    target: str = "all"
    overlay: Path | None = None
    mark: str = field(default_factory=lambda: uuid.uuid4().hex)
    _log_start: int = 0

    def __post_init__(self) -> None:
        copy_checkout(self.folder)

    @property
    def results(self) -> Path:
        """Folder of the results."""
        return self.folder / "results" / "tiny"

    def inside(self, names: Iterable[str]) -> list[str]:
        """Names of files that are in the results, as seen from there."""
        paths = (self.folder / name for name in names)
        return [path.relative_to(self.results).as_posix() for path in paths if path.is_relative_to(self.results)]

    @property
    def environment(self) -> dict[str, str]:
        """That of a user who has the project's programs on PATH, and no settings for other ones."""
        environ = dict(os.environ)
        remove(environ, *OF_SHELL_AND_PYTHON)
        isolate_libraries(environ)
        path = os.pathsep.join([str(Path(sys.executable).parent), environ["PATH"]])
        return environ | {"PATH": path, "PYTHONPATH": str(self.folder / "scripts"), MARK: self.mark}

    def snakemake(self, *arguments: str) -> list[str]:
        """Command line of Snakemake."""
        scales = ["config/tiny.yaml", *([str(self.overlay)] if self.overlay else [])]
        program = Path(sys.executable).with_name("snakemake")
        return [str(program), *arguments, "--cores", "2", "--configfile", *scales]

    @property
    def log(self) -> Path:
        """What all calls of Snakemake have printed."""
        return self.folder / "snakemake.log"

    def said_last(self) -> str:
        """What the last call of Snakemake has printed."""
        return self.log.read_bytes()[self._log_start :].decode(errors="replace")

    def _popen(self, command: list[str], **streams: object) -> psutil.Popen:
        return psutil.Popen(command, cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL, **streams)

    @contextlib.contextmanager
    def started(self, *arguments: str) -> Iterator[psutil.Popen]:
        """Snakemake in a session of its own; what it prints is added to snakemake.log."""
        with self.log.open("ab") as log:
            self._log_start = log.tell()
            command = self.snakemake(self.target, *arguments)
            process = self._popen(command, stdout=log, stderr=log, start_new_session=True)
            try:
                yield process
            finally:
                if process.is_running():
                    end(self.processes())

    def run(self, *arguments: str) -> str:
        """Run Snakemake to its end; return what it printed. RuntimeError if it failed."""
        return self.shell(shlex.join(self.snakemake(*arguments)), check=True).stdout

    def do(self, job: Job) -> subprocess.CompletedProcess:
        """Run a job by its own command, in the folders that Snakemake makes for it."""
        self.prepare(job)
        return self.shell(job.command)

    def made(self, job: Job) -> bool:
        """Whether all outputs of a job are there; the dump does not stay."""
        return all((self.folder / name).exists() for name in job.outputs if not name.endswith("dump.lammpstrj"))

    def prepare(self, job: Job) -> None:
        """Make the folders of a job's outputs and of its log."""
        for name in (*job.outputs, job.log):
            (self.folder / name).parent.mkdir(parents=True, exist_ok=True)

    def shell(self, command: str, check: bool = False) -> subprocess.CompletedProcess:
        """Run a command line as Snakemake does; stdout holds all that it printed."""
        with self.begun(command) as process:
            said, _ = process.communicate(timeout=CALL_LIMIT_S)
        if check and process.returncode:
            raise RuntimeError(f"exit code {process.returncode} of {command}:\n{said[-5000:]}")
        return subprocess.CompletedProcess(command, process.returncode, said)

    @contextlib.contextmanager
    def begun(self, command: str) -> Iterator[psutil.Popen]:
        """A command line as Snakemake runs it; what is left of it behind the block is killed."""
        shell = ["bash", "-euo", "pipefail", "-c", command]
        said = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, "errors": "replace"}
        process = self._popen(shell, **said)
        try:
            yield process
        finally:
            if process.poll() is None:
                end(self.processes())

    def jobs(self, *targets: str) -> list[Job]:
        """All jobs that lead to the targets, in an order in which they may run."""
        plan = self.run(*targets, "--forceall", "--dry-run")
        found = []
        pattern = r"^ *(?:local)?rule (\w+):\n(.*?)^Shell command: ([^\n]+)$"
        for rule, about, command in re.findall(pattern, plan, re.M | re.S):
            lists = {key: tuple(names.split(", ")) for key, names in re.findall(r"^ *(\w+): (.+)$", about, re.M)}
            if "output" in lists:
                wildcards = dict(pair.split("=") for pair in lists.get("wildcards", ()))
                found.append(Job(rule, wildcards, lists.get("input", ()), lists["output"], command))
        return found

    def processes(self) -> list[psutil.Process]:
        """All living processes of this campaign, orphans included."""
        found = []
        for process in psutil.process_iter():
            with contextlib.suppress(psutil.Error, OSError):
                if process.environ().get(MARK) == self.mark and process.status() != psutil.STATUS_ZOMBIE:
                    found.append(process)
        return found

    def outlived(self) -> str:
        """Names and pids of processes that are still there after a while; they are ended then."""
        limit = time.monotonic() + ORPHAN_LIMIT_S
        while left := self.processes():
            if time.monotonic() > limit:
                said = ", ".join(f"{process.name()} (pid {process.pid})" for process in left)
                end(left)
                return said
            time.sleep(0.2)
        return ""


def end(processes: list[psutil.Process]) -> None:
    """SIGKILL to each; psutil makes sure that the pid is still that of the process that was meant."""
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.kill()


def snapshot(folder: Path) -> Mapping[str, tuple[int, int, int]]:
    """What tells whether a file of the results was touched: inode, size and time; logs aside."""
    states = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and not name.startswith("logs/"):
            state = path.stat()
            states[name] = (state.st_ino, state.st_size, state.st_mtime_ns)
    return states
