"""What `make` does to .venv, with a Python that only notes how it is called."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from configurations import ROOT

PYTHON = """#!/bin/sh
pip=$(env | grep ^PIP_ | sort | tr '\n' ' ')
echo "$@ user: ${pip}path=$PYTHONPATH home=$HOME" >>calls
if [ "$2" = venv ]; then
    for folder; do :; done
    case "$*" in *--clear*) rm -rf "$folder";; esac
    mkdir -p "$folder/bin" "$folder/lib/python3.11/site-packages"
    cp "$0" "$folder/bin/python"
    echo "command = $0 ${*% *} $(pwd -P)/$folder" >"$folder/pyvenv.cfg"
elif [ "$3" = install ]; then
    cp "$0" .venv/bin/snakemake
    pwd -P >.venv/lib/python3.11/site-packages/__editable__.slurrycast-0.1.0.pth
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


def make(folder: Path, **variables: str) -> tuple[list[str], str]:
    """How Python was called by `make .venv/installed`, and what make printed."""
    (folder / "calls").unlink(missing_ok=True)
    command = ["make", ".venv/installed", f"PYTHON={folder.parent / 'python3'}"]
    environ = {name: value for name, value in os.environ.items() if not name.startswith(("HOME", "PIP_"))}
    done = subprocess.run(command, cwd=folder, env=environ | variables, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    calls = (folder / "calls").read_text().splitlines() if (folder / "calls").exists() else []
    return calls, done.stdout


@pytest.mark.parametrize("home", [{}, {"HOME": ""}, {"HOME": " "}])
def test_pip_installs_into_the_environment_whatever_the_user_has_set(project, home):
    what = ("USER", "TARGET", "CONSTRAINT", "REQUIREMENT", "REQUIRE_HASHES", "NO_BINARY", "PLATFORM", "HOME", "PREFIX")
    user = {f"PIP_{name}": "/none" for name in what} | {"PYTHONPATH": "/none"}
    whence = {"PIP_INDEX_URL": "https://a.b", "PIP_NO_CACHE_DIR": "1"}
    calls, _ = make(project, **user, **whence, **home)
    installs = [call for call in calls if "pip install" in call]
    assert len(installs) == 2
    expected = f" user: PIP_INDEX_URL=https://a.b PIP_NO_CACHE_DIR=1 path= home={project}/.venv"
    assert all("--no-user" in call and call.endswith(expected) for call in installs)


def test_the_path_of_the_package_is_relative(project):
    """An absolute one that is not ASCII stops any Python in a locale such as C."""
    make(project)
    (path,) = project.glob(".venv/lib/python3*/site-packages/*.pth")
    assert (path.parent / path.read_text().strip()).resolve() == project / "scripts"
    assert path.read_text().isascii()


def made(folder: Path) -> list[str]:
    """How `make` made .venv, and what it said about that."""
    calls, printed = make(folder)
    said = [line for line in printed.splitlines() if "anew" in line]
    return said + [call.split(" user:")[0] for call in calls if "-m venv" in call]


def test_an_environment_that_was_moved_or_lost_its_python_is_made_anew(project):
    assert [" ".join(call.split()) for call in made(project)] == ["-m venv .venv"]
    assert made(project) == []
    project.rename(project.with_name("renamed")).rename(project)
    assert made(project) == []
    project = project.rename(project.with_name("another folder"))
    assert made(project) == [".venv is made anew: it was made in another folder", "-m venv --clear .venv"]
    assert made(project) == []
    (project / ".venv" / "bin" / "python").unlink()
    assert made(project) == [".venv is made anew: its Python is gone", "-m venv --clear .venv"]
    (project / ".venv").rename(project.with_name("elsewhere"))  # as on a file system with more space
    (project / ".venv").symlink_to(project.with_name("elsewhere"))
    assert made(project) == []


def test_an_environment_of_another_tool_is_kept(project):
    (project / ".venv" / "bin").mkdir(parents=True)
    shutil.copy(project.parent / "python3", project / ".venv" / "bin" / "python")
    (project / ".venv" / "bin" / "own").touch()
    (project / ".venv" / "pyvenv.cfg").write_text("home = /usr/bin\nimplementation = CPython\nuv = 0.5.1\n")
    assert [" ".join(call.split()) for call in made(project)] == ["-m venv .venv"]
    assert (project / ".venv" / "bin" / "own").exists()
    assert made(project) == []
