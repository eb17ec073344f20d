"""Start LAMMPS, follow its progress and check its log."""

import contextlib
import shutil
import signal
import subprocess
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import psutil

from slurrycast.dem.forcefield import contact_styles
from slurrycast.dem.lammps_log import Log, read_log, thermo_row
from slurrycast.dem.neighbour_lists import skin_um
from slurrycast.dem.recipe import particle_types
from slurrycast.runtime.files import InputError, RunError
from slurrycast.runtime.lammps_help import ask
from slurrycast.runtime.programs import Launcher, ended_by, ending, last_words, shared_memory_cause

SCRIPTS = Path(__file__).resolve().parents[2] / "lammps"
DISK_FULL_BYTES = 1 << 20


def force_field_variables(physics: Mapping) -> dict[str, object]:
    """The -var settings that every script with real forces needs, from the physics of a slurry."""
    dem, types = physics["dem"], particle_types(physics["formulation"]["phases"])
    return {
        "skin_um": skin_um(dem, types),
        "contact_styles": contact_styles(types, physics["force_field"]),
        "timestep_us": dem["timestep_us"],
        "temperature_k": dem["temperature_k"],
        "temperature_damping_us": dem["temperature_damping_us"],
        "barostat": dem["barostat"],
        "pressure_kpa": dem["pressure_kpa"],
        "pressure_damping_us": dem["pressure_damping_us"],
    }


def steps_per_frame(dem: Mapping) -> int:
    """Steps from one frame to the next, from the section dem."""
    return dem["steps"] // (dem["frames"] - 1)


class Progress:
    """Reports at intervals how far a run is: `say` is called with one line."""

    def __init__(self, name: str, first: int, last: int, say: Callable[[str], None], every_s: float = 5.0) -> None:
        self._name, self._first, self._last, self._say, self._every_s = name, first, last, say, every_s
        self._start = self._said = time.monotonic()

    def __call__(self, step: int, density_g_cm3: float) -> None:
        """Report `step` and density if the last report is long enough ago."""
        now = time.monotonic()
        if now - self._said < self._every_s or step <= self._first:
            return
        self._said = now
        left_s = (now - self._start) * (self._last - step) / (step - self._first)
        self._say(
            f"[{self._name}] step {step} of {self._last} ({step / self._last:.0%}), density {density_g_cm3:.3f} g/cm3, "
            f"{now - self._start:.0f} s, about {left_s:.0f} s left"
        )


def run_lammps(
    launcher: Launcher,
    script: str,
    variables: Mapping[str, object],
    folder: Path,
    log: str,
    progress: Callable[[int, float], None] | None = None,
) -> Log:
    """Run LAMMPS and return its log.

    Parameters
    ----------
    launcher
        How LAMMPS is started.
    script, variables
        Name of a script in scripts/lammps, and the variables that it is given with -var.
    folder, log
        Folder in which it runs, and the name of its log there.
    progress
        Called with step and density for each line of the thermo table as it is printed.

    Raises
    ------
    RunError
        If LAMMPS fails, or its processor grid is not the ranks asked for: some launchers start N copies of one rank,
        which then overwrite each other's files.
    InputError
        If LAMMPS or the launcher cannot be found.
    """
    settings = [part for name, value in variables.items() for part in ("-var", name, str(value))]
    command = [*launcher.command(), "-in", str(SCRIPTS / script), "-log", log, "-nocite", *settings]
    (folder / log).unlink(missing_ok=True)
    columns: list[str] = []
    tail: deque[str] = deque(maxlen=20)
    error = ""
    with _started(command, folder, launcher) as process:
        try:
            for line in process.stdout:
                if line.strip():
                    tail.append(line)
                if line.startswith("ERROR"):
                    error = error or line.strip()
                if line.split()[:1] == ["Step"]:
                    columns = line.split()
                elif progress and "v_density_g_cm3" in columns and (row := thermo_row(line, len(columns))):
                    progress(int(row[0]), row[columns.index("v_density_g_cm3")])
        except BaseException:
            with contextlib.suppress(ProcessLookupError, psutil.NoSuchProcess):
                _end(process, launcher.ranks)
            raise
    place = f"; log: {folder / log}" if (folder / log).exists() else ""
    if error:  # of any rank; the log holds those of the first one
        raise RunError(f"LAMMPS: {error}{_cause(folder, launcher)}{place}")
    if process.returncode:
        how = ending(process.returncode, tail) + _cause(folder, launcher, process.returncode)
        raise RunError(f"LAMMPS ended with {how}{place}")
    if not place:
        cause = _cause(folder, launcher) or ("; check dem.launcher" if launcher.ranks > 1 else "")
        raise RunError(f"LAMMPS wrote no log: {last_words(tail)}{cause}")
    result = read_log(folder / log)
    if result.ranks != launcher.ranks:
        raise RunError(
            f"LAMMPS ran on {result.ranks} MPI ranks where dem.ranks asks for {launcher.ranks}: check dem.launcher; "
            f"log: {folder / log}"
        )
    return result


def _cause(folder: Path, launcher: Launcher, code: int = 0) -> str:
    """A cause that LAMMPS may not name: disk, memory, itself; `code` is its exit code if it named no error at all."""
    if not folder.exists():
        return "; the work folder is gone"
    if shutil.disk_usage(folder).free < DISK_FULL_BYTES:
        return "; the disk is full"
    if code and (cause := shared_memory_cause(launcher.ranks)):
        return cause
    if ended_by(code) == signal.SIGKILL:
        return "; memory may have run out"
    with contextlib.suppress(InputError):
        if problem := ask(replace(launcher, ranks=1)).problem():
            return f"; {problem}"
    return ""


def _end(process: subprocess.Popen, ranks: int) -> None:
    """End LAMMPS: a launcher ends its ranks when it is asked to; one that runs alone does not hear that."""
    if ranks > 1:
        process.terminate()
        return
    for child in psutil.Process(process.pid).children(recursive=True):  # `lmp` may be a script that starts LAMMPS
        with contextlib.suppress(psutil.NoSuchProcess):
            child.kill()
    process.kill()


def _started(command: list[str], folder: Path, launcher: Launcher) -> subprocess.Popen:
    """Start LAMMPS with the locks of this process; one that runs alone does not hear SIGTERM.

    Schedulers send it to every process of a job, and it is this process that decides when LAMMPS ends.
    """
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM} if launcher.ranks == 1 else ())
    try:
        return subprocess.Popen(
            command,
            cwd=folder,
            env=launcher.environment(),
            close_fds=False,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
        )
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def refuse_lost_history(log: Path, restart: Path) -> None:
    """RunError if LAMMPS dropped a part of the file `restart`, the contact history, as its `log` says at the end."""
    if "Unused restart file" in log.read_text(encoding="utf-8", errors="replace"):
        raise RunError(f"LAMMPS: dropped a part of the restart file {restart}; log: {log}")
