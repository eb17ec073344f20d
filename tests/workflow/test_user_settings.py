"""Jobs in the environments of users: their own Python and settings, no usable home folder, no name."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from checkouts import copy_checkout, snakemake
from user_settings import hostile

TARGETS = ("results/tiny/dem/T1/inputs.json", "results/tiny/versions.json")
# Another user than root that may still read the environment of the tests, wherever it is.
WITHOUT_NAME = "setpriv --reuid=54321 --regid=54321 --clear-groups --inh-caps=+dac_read_search --ambient-caps"
PREFIX = (*WITHOUT_NAME.split(), "+dac_read_search")


def made(project: Path, environ: dict[str, str], *prefix: str) -> dict:
    """Make a few files in an environment; the record of the versions."""
    snakemake(project, *TARGETS, "--configfile", "config/tiny.yaml", environment=environ, prefix=prefix)
    assert (project / TARGETS[0]).is_file()
    return json.loads((project / TARGETS[1]).read_text(encoding="utf-8"))


def test_another_python_and_other_settings(tmp_path):
    project = copy_checkout(tmp_path / "ein Ordner ü")
    repository = {"GIT_DIR": str(tmp_path / "other" / ".git"), "GIT_WORK_TREE": str(tmp_path / "other")}
    user = hostile(tmp_path)
    subprocess.run(["git", "init", "-q", tmp_path / "other"], check=True)
    commit = ["git", "-c", "user.name=A", "-c", "user.email=a@b.c", "commit", "-q", "--allow-empty", "-m", "A"]
    subprocess.run(commit, cwd=tmp_path / "other", check=True)
    assert made(project, user | repository)["workflow_commit"] == "unknown"
    home = {path.name for path in (tmp_path / "home").iterdir()}
    assert home == {".keras", ".config"}


@pytest.mark.skipif(os.geteuid() != 0 or shutil.which("setpriv") is None, reason="only root can become another user")
def test_a_number_without_name_and_home(tmp_path):
    """As in a container."""
    project = copy_checkout(tmp_path / "checkout")
    subprocess.run(["chown", "-R", "54321", project], check=True)
    for folder in (tmp_path, *tmp_path.parents[:2]):
        folder.chmod(0o755)
    user = {name: value for name, value in os.environ.items() if name not in ("USER", "LOGNAME")}
    assert made(project, user | {"HOME": "/"}, *PREFIX)
    assert (project / TARGETS[0]).stat().st_uid == 54321
