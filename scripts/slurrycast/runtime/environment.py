"""The environment that jobs and scripts run in: what a user has set for other programs does not reach them.

The Snakefile asks for it each time it is parsed, also on the nodes of a cluster, so imports stay light.
"""

import filecmp
import getpass
import os
import site
import sys
import sysconfig
from collections.abc import Iterable, MutableMapping
from fnmatch import fnmatchcase
from importlib.machinery import PathFinder
from pathlib import Path

from slurrycast.runtime.files import InputError

# What Keras and matplotlib are told, before they are imported. Neither looks for a file of the user: the null device
# holds none. So Keras has its own defaults, float32 and channels_last, and writes no file either.
LIBRARIES = {
    "KERAS_BACKEND": "tensorflow",
    "KERAS_HOME": os.devnull,
    "MPLBACKEND": "agg",
    "MATPLOTLIBRC": os.devnull,
}
OF_LIBRARIES = ("KERAS_*", "TF_USE_LEGACY_KERAS", "XLA_FLAGS", "TF_XLA_FLAGS", "PYVISTA_*")
# What bash reads before it runs the command of a job, and what changes what Python imports, checks or encodes.
OF_SHELL_AND_PYTHON = ("BASH*", "ENV", "SHELLOPTS", "POSIXLY_CORRECT", "PYTHON*")
REQUIRED = "numpy"  # a package that every environment of the workflow has


def remove(environ: MutableMapping[str, str], *patterns: str) -> None:
    """Take the variables whose names fit one of the patterns out of `environ`."""
    for name in [name for name in environ if any(fnmatchcase(name, pattern) for pattern in patterns)]:
        del environ[name]


def isolate_libraries(environ: MutableMapping[str, str]) -> None:
    """Let the libraries that this process, or one with `environ`, imports from now on see no settings of the user."""
    remove(environ, *OF_LIBRARIES)
    environ |= LIBRARIES


def isolate_jobs(scripts: Path, cache: Path) -> None:
    """Let this process, which is Snakemake, and its jobs import and run nothing from paths of the user.

    Jobs find the Python that runs Snakemake, activated or not, LAMMPS from the same environment, and the package in
    `scripts`, even if another one is installed. The path of that Python enters no command, so it repeats no job.

    Parameters
    ----------
    scripts
        Folder of the package.
    cache
        Folder for what libraries keep from one job to the next.

    Raises
    ------
    InputError
        If that Python is no environment that jobs can use: it has another name, or packages only in PYTHONPATH. If
        matplotlib cannot read its settings in the working directory.
    """
    programs = Path(sys.executable).parent
    python = programs / "python"
    if not python.exists() or not filecmp.cmp(python, sys.executable):  # which may be the same file, or a copy
        raise InputError(
            f"{programs}: no `python` beside the Python that runs Snakemake, or another, and jobs call it: use a venv"
        )
    _check_matplotlibrc(Path("matplotlibrc"))
    own, python_path = _folders(sysconfig.get_paths().values()), os.environ.get("PYTHONPATH", "").split(os.pathsep)
    foreign = _folders(path for path in python_path if path) - own
    sys.path[:] = [str(scripts), *(path for path in sys.path if not _folders([path]) & foreign)]
    remove(os.environ, *OF_SHELL_AND_PYTHON)
    isolate_libraries(os.environ)
    os.environ |= {
        "PATH": os.pathsep.join([str(programs), os.environ.get("PATH", os.defpath)]),
        "PYTHONPATH": str(scripts),
        "PYTHONUTF8": "1",
        "MPLCONFIGDIR": str(cache / "matplotlib"),
    }
    # Packages that `pip install --user` installed hide those of the environment, unless they are the environment.
    without_user_site = [path for path in sys.path if path != site.getusersitepackages()]
    if PathFinder.find_spec(REQUIRED, without_user_site):
        sys.path[:], os.environ["PYTHONNOUSERSITE"] = without_user_site, "1"
    elif not PathFinder.find_spec(REQUIRED, sys.path):
        raise InputError(f"{sys.prefix}: {REQUIRED} is not installed there, and jobs see no PYTHONPATH: use a venv")
    try:
        getpass.getuser()
    except (KeyError, OSError):  # in a container a user may be a number without name, and Snakemake asks for the name
        os.environ["USER"] = str(os.getuid())


def _check_matplotlibrc(path: Path) -> None:
    """Refuse a file with which matplotlib stops. It comes before the one that MATPLOTLIBRC names."""
    try:
        if path.is_file():
            path.read_text(encoding="utf-8")
    except (UnicodeDecodeError, OSError):
        raise InputError(
            f"{path.absolute()}: matplotlib reads it from the working directory: must be UTF-8, or lie elsewhere"
        ) from None


def _folders(paths: Iterable[str]) -> set[Path]:
    return {Path(path).resolve() for path in paths}
