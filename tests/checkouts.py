"""Checkouts for tests, and Snakemake as a user calls it in them."""

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from configurations import ROOT

PARTS = ("Snakefile", "config", "envs", "profiles", "scripts", "workflow")


def copy_checkout(folder: Path) -> Path:
    """Copy what the workflow consists of to `folder`, and return it."""
    folder.mkdir(exist_ok=True)
    for part in PARTS:
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
        else:
            shutil.copy(source, folder / part)
    return folder


def snakemake(
    project: Path,
    *arguments: str,
    fails: bool = False,
    python: str | Path = sys.executable,
    environment: Mapping[str, str] = os.environ,
    prefix: Sequence[str] = (),
) -> str:
    """Run Snakemake in `project` with a Python of an environment that is not activated; return all that it prints."""
    program = Path(sys.executable).with_name("snakemake")
    command = [*prefix, python, program, "--cores", "2", *arguments]
    environment = {name: value for name, value in environment.items() if name not in ("VIRTUAL_ENV", "DISPLAY")}
    done = subprocess.run(
        command, cwd=project, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert (done.returncode != 0) == fails, done.stdout[-5000:]
    return done.stdout
