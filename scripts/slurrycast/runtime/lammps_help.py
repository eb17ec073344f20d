"""What a LAMMPS says of itself, and whether the scripts in scripts/lammps can run with it."""

import contextlib
import os
import re
import signal
import subprocess
from dataclasses import dataclass

from slurrycast.runtime.files import InputError
from slurrycast.runtime.programs import Launcher, ending, last_words, shared_memory_cause

MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
# Found by trying stable releases: the one before, 23 Jun 2022, does not know `dump_modify skip`.
OLDEST = "2 Aug 2023"
PATIENCE_S = 60
# What scripts/lammps uses. The forces and the count of contacts come with GRANULAR, all others with any LAMMPS.
STYLES = {
    "atom": ("sphere",),
    "minimize": ("cg",),
    "pair": ("soft", "hybrid/overlay", "lj/cut", "gran/hertz/history"),
    "fix": ("npt/sphere", "nvt/sphere", "press/berendsen", "deform"),
    "compute": ("contact/atom", "erotate/sphere", "pe/atom", "reduce"),
    "dump": ("custom",),
}


@dataclass(frozen=True)
class LammpsHelp:
    """The help text of the LAMMPS that `launcher` starts; empty if it gave none."""

    launcher: Launcher
    text: str

    @property
    def version(self) -> str:
        """Version as in a log, such as "2 Aug 2023 - Update 3"; "unknown" if it says none."""
        return self._found(r"Massively Parallel Simulator[^\w\n]*(\w.*)")

    @property
    def mpi(self) -> str:
        """Version of the MPI that it is linked to, or "unknown"."""
        return self._found(r"^MPI (v.*)")

    def _found(self, pattern: str) -> str:
        match = re.search(pattern, self.text, re.MULTILINE)
        return " ".join(match[1].split()) if match else "unknown"

    def problem(self) -> str | None:
        """One line that names the key if it is no LAMMPS, is too old or lacks a style; None if not.

        A LAMMPS that lists no styles is not asked further.
        """
        if "Massively Parallel Simulator" not in self.text:
            words = last_words(self.text.splitlines())
            return f"{_asked(self.launcher)} does not answer -h as LAMMPS does: {words}"
        lammps = f"dem.executable: {self.launcher.executable!r}"
        released = _released(self.version)
        if released is None:
            return f"{lammps} is LAMMPS of version {self.version!r}, without a date: must be {OLDEST} or newer"
        if released < _released(OLDEST):
            return f"{lammps} is LAMMPS {self.version}: must be {OLDEST} or newer"
        listed = dict(re.findall(r"^\* (\w+) styles:?\n((?:(?!\* ).*\n?)*)", self.text, re.MULTILINE))
        known = {kind.lower(): set(styles.split()) for kind, styles in listed.items()}
        for kind, styles in STYLES.items():
            for style in styles:
                if kind in known and style not in known[kind]:
                    return f"{lammps} lacks {kind} style {style}: must have the package GRANULAR"
        return None


def _released(version: str) -> tuple[int, int, int] | None:
    """Year, month and day in a version such as "2 Aug 2023" or "patch_2Aug2023"; None if there is no such date."""
    match = re.search(rf"(?<!\d)(\d{{1,2}})[ _-]?({'|'.join(MONTHS)})[a-z]*[ _-]?(\d{{4}})(?!\d)", version)
    return (int(match[3]), MONTHS.index(match[2]), int(match[1])) if match else None


def _asked(launcher: Launcher) -> str:
    """Key and value to begin a line with about a call that failed; with several ranks either program may be why."""
    if launcher.ranks == 1:
        return f"dem.executable: {launcher.executable!r}"
    return f"dem.launcher: {launcher.launcher!r} with dem.executable {launcher.executable!r}"


def ask(launcher: Launcher) -> LammpsHelp:
    """Ask a LAMMPS, started as it is for a run, for its help text.

    InputError if it cannot be started, fails or gives no answer.
    """
    try:
        process = subprocess.Popen(
            [*launcher.command(), "-h"],
            env=launcher.environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,  # so that all that it starts can be ended with it
        )
    except OSError as error:
        raise InputError(f"{_asked(launcher)} cannot be started: {error.strerror}") from None
    with process:
        try:
            text, _ = process.communicate(timeout=PATIENCE_S)
        except BaseException as error:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            if isinstance(error, subprocess.TimeoutExpired):
                raise InputError(f"{_asked(launcher)} -h gave no answer in {PATIENCE_S} s") from None
            raise
    if process.returncode:
        how = ending(process.returncode, text.splitlines()) + shared_memory_cause(launcher.ranks)
        raise InputError(f"{_asked(launcher)} -h ended with {how}")
    return LammpsHelp(launcher, text)
