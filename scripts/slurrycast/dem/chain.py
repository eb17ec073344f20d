"""The slurry DEM as a chain of LAMMPS processes: a few openings, then segments that each go on from a restart file.

A chain that was killed goes on from its last finished part that is undamaged, and ends with the same numbers.
"""

import functools
import hashlib
import itertools
import os
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from slurrycast.dem.lammps_log import Log, read_log
from slurrycast.dem.lammps_run import (
    SCRIPTS,
    Launcher,
    Progress,
    force_field_variables,
    refuse_lost_history,
    run_lammps,
    steps_per_frame,
)
from slurrycast.runtime.costs import Cost, children_cpu_s
from slurrycast.runtime.files import RunError, Unfinished, checksum
from slurrycast.runtime.stopping import Stop
from slurrycast.runtime.work_folder import WorkFolder

COEFFICIENTS = "coefficients.lmp"  # in the work folder
DUMP_HEADER_LINES = 9  # of each frame, before its particles
RESTART_END = b"LammpS RestartT\0"  # the last bytes of a restart file


def boundaries(frame_steps: int, last_frame: int, segment_frames: int, restart_frames: Sequence[int]) -> list[int]:
    """Steps at which the segments of a run begin and end: every `segment_frames` frames and at each restart frame."""
    frames = {*range(0, last_frame, segment_frames), *restart_frames, last_frame}
    return [frame * frame_steps for frame in sorted(frames) if frame <= last_frame]


def identity(inputs: Sequence[Path], scripts: Sequence[str], settings: str = "") -> str:
    """Digest of everything that determines a run: its inputs, the LAMMPS `scripts` and further `settings`."""
    files = [*inputs, *(SCRIPTS / name for name in scripts)]
    return hashlib.sha256(("".join(map(checksum, files)) + settings).encode()).hexdigest()


def run_part(
    work: WorkFolder,
    attempt: Path | None,
    part: str,
    files: Sequence[str],
    launcher: Launcher,
    script: str,
    variables: Mapping[str, object],
    progress: Callable[[int, float], None] | None = None,
    check: Callable[[], None] = lambda: None,
) -> Log:
    """Run LAMMPS and record that this part is finished, with the files that it wrote and its cost.

    Parameters
    ----------
    work, attempt
        The work folder, and the log of this attempt, if there is one: the log of an earlier attempt at the part is kept
        beside it.
    part, files
        Name of the part, and of the files that it writes.
    launcher, script, variables, progress
        As `run_lammps` takes them.
    check
        Called when LAMMPS has ended; it may refuse the files.

    Raises
    ------
    RunError
        As `run_lammps`, and from `check`.
    """
    log = f"{part}.log"
    if attempt is not None and (work.path / log).exists():
        shutil.move(work.path / log, attempt.with_name(f"{attempt.stem}_found_{log}"))
    wall_s, cpu_s = time.perf_counter(), children_cpu_s()
    result = run_lammps(launcher, script, variables, work.path, log, progress)
    check()
    spent = {"wall_s": time.perf_counter() - wall_s, "cpu_s": children_cpu_s() - cpu_s}
    work.record(part, [*files, log], spent)
    return result


def check_restart(restart: Path) -> None:
    """Refuse, with RunError, a restart file that is not complete."""
    with restart.open("rb") as file:
        file.seek(-min(len(RESTART_END), restart.stat().st_size), os.SEEK_END)
        if file.read() != RESTART_END:
            raise RunError(f"{restart}: has no end: LAMMPS could not write it whole; is the disk full?")


@dataclass(frozen=True)
class Opening:
    """A part before the segments: `script` of scripts/lammps with further `variables` writes `file`.

    `check` may refuse what the part wrote.
    """

    part: str
    file: str
    variables: Mapping[str, object]
    check: Callable[[], None] = lambda: None

    @property
    def script(self) -> str:
        """LAMMPS script, named after the part."""
        return f"{self.part}.lmp"


@dataclass(frozen=True)
class Chain:
    """The DEM of a slurry in the parts `openings`, then a segment between each two of `steps`.

    `name` stands in messages, `inputs` is the content of inputs.json. The last opening leaves step_<first>.restart,
    of the first of `steps`; each segment leaves frames_<last>.dump and step_<last>.restart.
    """

    name: str
    inputs: Mapping
    openings: Sequence[Opening]
    steps: Sequence[int]

    @property
    def segments(self) -> dict[str, tuple[int, int]]:
        """First and last step of each segment, by part."""
        return {f"segment_{last}": (first, last) for first, last in itertools.pairwise(self.steps)}

    @property
    def parts(self) -> list[str]:
        """All parts in their order."""
        return [*(opening.part for opening in self.openings), *self.segments]

    def run(
        self, work: WorkFolder, attempt: Path | None, launcher: Launcher, stop: Stop, cost: Cost | None = None
    ) -> list[Log]:
        """Run the parts that are not finished in `work` yet; return the logs of all segments.

        What earlier attempts spent on finished parts is added to `cost`, if there is one. RunError as of `run_lammps`,
        for files that are not complete, and if LAMMPS dropped the contact history of a restart file; Unfinished as
        `stop` wants it.
        """
        # Not by the restart files: each is there before the log of its segment is complete.
        done = list(itertools.takewhile(work.finished, self.parts))
        for part in self.parts[len(done) :]:
            work.forget(part)
        logs = self._run_missing(work, attempt, launcher, stop, done)
        for part in done if cost else ():
            spent = work.cost(part)
            cost.wall_s += spent["wall_s"]
            cost.cpu_s += spent["cpu_s"]
        return logs

    def _run_missing(
        self, work: WorkFolder, attempt: Path | None, launcher: Launcher, stop: Stop, done: Sequence[str]
    ) -> list[Log]:
        """Run the parts that are not `done`."""
        dem = self.inputs["physics"]["dem"]
        frame_steps = steps_per_frame(dem)
        variables = {
            **force_field_variables(self.inputs["physics"]),
            "coefficients": COEFFICIENTS,
            "thermo_every_steps": dem["thermo_every_steps"],
            "frame_every_steps": frame_steps,
        }
        segments = self.segments
        done_steps = max((last for part, (_, last) in segments.items() if part in done), default=self.steps[0])
        if done_steps > self.steps[0]:
            print(f"[{self.name}] goes on from step {done_steps} of {self.steps[-1]}")
        for opening in self.openings:
            if opening.part not in done:
                settings = {**variables, **opening.variables}
                files = [opening.file]
                run_part(work, attempt, opening.part, files, launcher, opening.script, settings, check=opening.check)
        report = Progress(self.name, done_steps, self.steps[-1], print)

        def progress(step: int, density_g_cm3: float) -> None:
            stop.reached(step)
            report(step, density_g_cm3)

        logs = []
        for part, (first, last) in segments.items():
            if part in done:
                logs.append(read_log(work.path / f"{part}.log"))
                continue
            stop.begin(first, last)
            ends = {**variables, "from": first, "to": last}
            files = [f"frames_{last}.dump", f"step_{last}.restart"]
            check = functools.partial(self._check_segment, work.path, first, last, frame_steps)
            try:
                logs.append(run_part(work, attempt, part, files, launcher, "slurry.lmp", ends, progress, check))
            except RunError as error:
                if stop.asked:  # a launcher passes the signal on, and LAMMPS ends by it
                    raise Unfinished(f"[{self.name}] stopped by {stop.asked}: {error}") from error
                raise
        return logs

    def _check_segment(self, work: Path, first: int, last: int, frame_steps: int) -> None:
        """Refuse the files of a segment, with RunError, if one is not complete or the contact history was not read."""
        frames = work / f"frames_{last}.dump"
        with frames.open("rb") as file:
            lines = sum(block.count(b"\n") for block in iter(lambda: file.read(1 << 20), b""))
        n_frames = (last - first) // frame_steps + (first == 0)
        expected = n_frames * (self.inputs["particles"] + DUMP_HEADER_LINES)
        if lines != expected:  # LAMMPS ignores a full disk
            raise RunError(
                f"{frames}: has {lines} lines of {expected}: LAMMPS could not write it whole; is the disk full?"
            )
        check_restart(work / f"step_{last}.restart")
        refuse_lost_history(work / f"segment_{last}.log", work / f"step_{first}.restart")
