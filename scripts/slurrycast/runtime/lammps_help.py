"""What a LAMMPS says of itself, and whether the scripts in scripts/lammps can run with it."""

import re
import subprocess
from dataclasses import dataclass

from slurrycast.runtime.files import InputError
from slurrycast.runtime.programs import Launcher, ending, shared_memory_cause

MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
# Found by trying stable releases: the one before, 23 Jun 2022, does not know `dump_modify skip`.
OLDEST = "2 Aug 2023"
# What scripts/lammps uses. The forces and the count of contacts come with GRANULAR, all others with any LAMMPS.
STYLES = {
    "atom": ("sphere",),
    "minimize": ("cg",),
    "pair": ("soft", "hybrid/overlay", "lj/cut", "gran/hertz/history"),
    "fix": ("npt/sphere", "nvt/sphere", "deform"),
    "compute": ("contact/atom", "erotate/sphere", "reduce"),
    "dump": ("custom",),
}


@dataclass(frozen=True)
class LammpsHelp:
    """The help text of the LAMMPS `executable`; empty if it gave none."""

    executable: str
    text: str

    @property
    def version(self) -> str:
        """Version as in a log, such as "2 Aug 2023 - Update 3"; "unknown" if it says none."""
        return self._found(r"Massively Parallel Simulator - (.*)")

    @property
    def mpi(self) -> str:
        """Version of the MPI that it is linked to, or "unknown"."""
        return self._found(r"^MPI (v.*)")

    def _found(self, pattern: str) -> str:
        match = re.search(pattern, self.text, re.MULTILINE)
        return " ".join(match[1].split()) if match else "unknown"

    def problem(self) -> str | None:
        """One line that names dem.executable if it is too old or lacks a style; None if not, or if it does not say."""
        if _released(self.version) < _released(OLDEST):
            return f"dem.executable: {self.executable!r} is LAMMPS {self.version}: must be {OLDEST} or newer"
        listed = dict(re.findall(r"^\* (\w+) styles:?\n((?:(?!\* ).*\n?)*)", self.text, re.MULTILINE))
        known = {kind.lower(): set(styles.split()) for kind, styles in listed.items()}
        for kind, styles in STYLES.items():
            for style in styles:
                if kind in known and style not in known[kind]:
                    lack = f"lacks {kind} style {style}: must have the package GRANULAR"
                    return f"dem.executable: {self.executable!r} {lack}"
        return None


def _released(version: str) -> tuple[int, int, int]:
    """Year, month and day in a version; later than any other if there is no such date."""
    match = re.match(rf"(\d{{1,2}}) ({'|'.join(MONTHS)})\w* (\d{{4}})\b", version)
    return (int(match[3]), MONTHS.index(match[2]), int(match[1])) if match else (9999, 0, 0)


def ask(launcher: Launcher) -> LammpsHelp:
    """Ask a LAMMPS, started as it is for a run, for its help text.

    InputError if it cannot be started or fails.
    """
    command = [*launcher.command(), "-h"]
    try:
        done = subprocess.run(
            command,
            env=launcher.environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
            timeout=60,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise InputError(f"dem.executable: {launcher.executable!r} cannot be asked for its version: {error}") from None
    if done.returncode:
        how = ending(done.returncode, done.stdout.splitlines()) + shared_memory_cause(launcher.ranks)
        raise InputError(f"dem.executable: {launcher.executable!r} -h ended with {how}")
    return LammpsHelp(launcher.executable, done.stdout)
