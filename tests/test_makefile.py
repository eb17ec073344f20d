"""What `make` does to .venv, with a Python that only notes how it is called."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from configurations import ROOT

PYTHON = """#!/bin/sh
echo "$@ user=$PIP_USER target=$PIP_TARGET path=$PYTHONPATH index=$PIP_INDEX_URL home=$HOME" >>calls
if [ "$2" = venv ]; then
    for folder; do :; done
    case "$*" in *--clear*) rm -rf "$folder";; esac
    mkdir -p "$folder/bin" "$folder/lib/python3.11/site-packages"
    pwd -P >"$folder/lib/python3.11/site-packages/__editable__.slurrycast-0.1.0.pth"
    cp "$0" "$folder/bin/python"
    touch "$folder/bin/snakemake"; chmod +x "$folder/bin/snakemake"
    echo "command = $0 ${*% *} $(pwd -P)/$folder" >"$folder/pyvenv.cfg"
fi
"""


@pytest.fixture
def project(tmp_path) -> Path:
    """A folder with the Makefile and the files that it reads, and that Python."""
    folder = tmp_path / "ein Ordner ü"
    folder.mkdir()
    shutil.copytree(ROOT / "envs", folder / "envs")
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy(ROOT / name, folder / name)
    (tmp_path / "python3").write_text(PYTHON)
    (tmp_path / "python3").chmod(0o755)
    return folder


def calls(folder: Path, **variables: str) -> list[str]:
    """How Python was called by `make .venv/installed`."""
    (folder / "calls").unlink(missing_ok=True)
    command = ["make", ".venv/installed", f"PYTHON={folder.parent / 'python3'}"]
    environ = {name: value for name, value in os.environ.items() if name != "HOME"}
    done = subprocess.run(command, cwd=folder, env=environ | variables, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return (folder / "calls").read_text().splitlines() if (folder / "calls").exists() else []


def test_pip_installs_into_the_environment_whatever_the_user_has_set(project):
    user = {"PIP_USER": "1", "PIP_TARGET": "/none", "PYTHONPATH": "/none", "PIP_INDEX_URL": "https://a.b"}
    installs = [call for call in calls(project, **user) if "pip install" in call]
    assert len(installs) == 2
    expected = f"user= target= path= index=https://a.b home={project}/.venv"
    assert all("--no-user" in call and call.endswith(expected) for call in installs)


def test_the_path_of_the_package_is_relative(project):
    """An absolute one that is not ASCII stops any Python in a locale such as C."""
    calls(project)
    (path,) = project.glob(".venv/lib/python3*/site-packages/*.pth")
    assert (path.parent / path.read_text().strip()).resolve() == project / "scripts"
    assert path.read_text().isascii()


def test_an_environment_that_was_moved_or_lost_its_python_is_made_anew(project):
    def made() -> list[str]:
        return [call.split(" user=")[0] for call in calls(project) if "-m venv" in call]

    anew = ["-m venv --clear .venv"]
    assert made() == anew
    assert made() == []
    project = project.rename(project.with_name("another folder"))
    assert made() == anew
    assert made() == []
    (project / ".venv" / "bin" / "python").unlink()
    assert made() == anew
    os.utime(project / ".venv" / "installed", (0, 0))  # newer requirements are put into the environment as it is
    assert [" ".join(call.split()) for call in made()] == ["-m venv .venv"]
