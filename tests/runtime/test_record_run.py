"""What a run was made with: recorded, never stale, and told apart by name."""

import hashlib
import json
import os
import platform
import re
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from importlib.metadata import version

import pytest
import yaml

from checkouts import copy_checkout, snakemake
from configurations import ROOT, read_slurries, shipped
from slurrycast.runtime import provenance
from slurrycast.runtime.files import CHECKSUMS, VERSIONS_VARIABLE, check_unchanged, write_text

MADE_WITH = {"workflow_commit": "abc", "python": "3.11.0", "packages": {"numpy": "1.0", "solver": "7"}}


def git(folder, *words: str) -> str:
    command = ["git", "-c", "user.name=A", "-c", "user.email=a@b.c", "-C", str(folder), *words]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture
def record(command, tmp_path):
    """Run the script; what it recorded."""

    def run(**changed) -> dict:
        paths = {name: tmp_path / name for name in ("config", "slurries", "versions", "kept")}
        effective = shipped("tiny")
        effective["dem"] |= changed
        slurries = read_slurries(ROOT / effective["slurries"])
        words = {"effective": json.dumps(effective), "made_with": json.dumps(MADE_WITH), "command": "snakemake -n"}
        words["rows"] = json.dumps([slurry.row() for slurry in slurries])
        subprocess.run(command("record_run", **words, **paths), check=True)
        assert yaml.safe_load(paths["config"].read_text()) == effective
        assert read_slurries(paths["slurries"]) == slurries
        assert list(effective["formulation"]["phases"]) == ["BDPD", "NiO", "8YSZ"]  # their order counts
        assert paths["kept"].read_bytes() == paths["versions"].read_bytes()
        return json.loads(paths["versions"].read_text(encoding="utf-8"))

    return run


def test_record(record, slurry):
    found = record()
    assert found["name"] == provenance.name_of(MADE_WITH)
    assert (found["workflow_commit"], found["python"], found["command"]) == ("abc", "3.11.0", "snakemake -n")
    age = datetime.now(UTC) - datetime.fromisoformat(found["recorded"])
    assert timedelta(seconds=-1) < age < timedelta(minutes=5)
    assert found["packages"]["solver"] == "7"
    assert found["packages"]["numpy"] == "1.0"  # what Snakemake saw
    assert found["packages"]["keras"] == version("keras")  # and what is only here
    # LAMMPS says the same of itself as in a log
    assert found["lammps_version"] == json.loads((slurry / "run.json").read_text())["lammps_version"]
    assert re.match(r"v\d.*\d", found["mpi"])
    assert found["platform"] == platform.platform()
    assert " x " in found["machine"]


def test_lammps_that_is_only_elsewhere(record):
    found = record(executable="lmp_of_the_cluster")
    assert (found["lammps_version"], found["mpi"]) == ("unknown", "unknown")


def test_versions_of_all_that_matters_are_found():
    found = provenance.package_versions()
    matter = {"snakemake", "lammps", "keras", "MDAnalysis", "numpy", "scipy", "pandas", "h5py", "freud-analysis"}
    assert matter | {"pyvista", "vtk", "matplotlib"} <= set(found)
    assert set(found) & {"tensorflow", "tensorflow-cpu"}
    assert all(found[name] == version(name) for name in found)


def test_commit_of_the_checkout_and_of_no_other(tmp_path, monkeypatch):
    outer, inner = tmp_path / "outer", tmp_path / "outer" / "inner"
    inner.mkdir(parents=True)
    git(outer, "init", "-q")
    (outer / "a").write_text("1")
    git(outer, "add", "a")
    git(outer, "commit", "-qm", "A")
    git(outer, "tag", "v1")
    commit = git(outer, "rev-parse", "HEAD")
    assert provenance.git_commit(outer) == commit
    assert provenance.git_commit(inner) == "unknown"
    (outer / "a").write_text("2")
    assert provenance.git_commit(outer) == f"{commit}-dirty"
    # whatever a hook of git says that works on another repository
    for name in ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_COMMON_DIR", "GIT_OBJECT_DIRECTORY"):
        monkeypatch.setenv(name, str(inner))
    # and whatever is wrong in a configuration of the user
    (tmp_path / ".gitconfig").write_text("[core\n")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert provenance.git_commit(outer) == f"{commit}-dirty"
    if os.geteuid() == 0:  # a checkout that another user owns, as in a container
        for path in (outer, outer / ".git"):
            os.chown(path, 12345, 12345)
        assert provenance.git_commit(outer) == f"{commit}-dirty"


def test_tests_touch_no_repository_of_the_user(tmp_path):
    """A hook of git calls them with the variables of its repository, and with settings that would stop a commit."""
    repository = tmp_path / "repository"
    git(tmp_path, "init", "-q", str(repository))
    home = tmp_path / "home"
    home.mkdir()
    (home / ".gitconfig").write_text("[commit]\ngpgsign = true\n[gpg]\nprogram = false\n[core]\nhooksPath = /none\n")
    before = {path: path.stat().st_mtime_ns for path in repository.rglob("*")}
    named = {"GIT_DIR": ".git", "GIT_WORK_TREE": ".", "GIT_INDEX_FILE": ".git/index"}
    user = {name: str(repository / path) for name, path in named.items()} | {"HOME": str(home)}
    test = f"{__file__}::test_commit_of_the_checkout_and_of_no_other"
    subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", test], env=os.environ | user, check=True
    )
    assert {path: path.stat().st_mtime_ns for path in repository.rglob("*")} == before


def test_name_differs_where_anything_does():
    other = [MADE_WITH | {"workflow_commit": "abc-dirty"}, MADE_WITH | {"packages": {"numpy": "1.1", "solver": "7"}}]
    names = {provenance.name_of(versions) for versions in (MADE_WITH, *other)}
    assert len(names) == 3
    assert all(re.fullmatch("[0-9a-f]{12}", name) for name in names)
    assert provenance.name_of(dict(reversed(MADE_WITH.items()))) == provenance.name_of(MADE_WITH)


def test_name_stands_with_the_checksum_of_an_output(tmp_path, monkeypatch):
    monkeypatch.setenv(VERSIONS_VARIABLE, "0123456789ab")
    write_text(tmp_path / "table.csv", "a\n")
    kept = tmp_path / CHECKSUMS / "table.csv.sha256"
    assert kept.read_text() == f"{hashlib.sha256(b'a' + bytes([10])).hexdigest()}  table.csv\n# versions 0123456789ab\n"
    check_unchanged(tmp_path / "table.csv")
    # a comment to the program whose format it is
    subprocess.run(["sha256sum", "-c", "--strict", kept], cwd=tmp_path, check=True)


@pytest.mark.slow
def test_recorded_anew_for_another_commit_or_package_and_for_nothing_else(tmp_path):
    project = copy_checkout(tmp_path / "checkout")
    (project / ".gitignore").write_text("results/\n.snakemake/\n__pycache__/\n")
    git(project, "init", "-q")
    git(project, "add", ".")
    git(project, "commit", "-qm", "A")
    results, tiny = project / "results" / "tiny", ("--configfile", "config/tiny.yaml")
    versions = "results/tiny/versions.json"

    def recorded() -> dict:
        return json.loads((project / versions).read_text(encoding="utf-8"))

    snakemake(project, versions, "results/tiny/dem/T1/initial.data", *tiny)
    first = recorded()
    assert first["workflow_commit"] == git(project, "rev-parse", "HEAD")
    assert first["command"] == f"snakemake --cores 2 {versions} results/tiny/dem/T1/initial.data {' '.join(tiny)}"
    checksum_file = results / "dem" / "T1" / CHECKSUMS / "initial.data.sha256"
    assert checksum_file.read_text().splitlines()[1] == f"# versions {first['name']}"
    assert "Nothing to be done" in snakemake(project, versions, "--quiet", "host", *tiny)  # another command

    git(project, "commit", "-q", "--allow-empty", "-m", "B")
    assert "Params have changed" in snakemake(project, versions, *tiny)
    second = recorded()
    assert second["workflow_commit"] == git(project, "rev-parse", "HEAD") != first["workflow_commit"]
    assert {path.stem for path in (results / "versions").glob("*.json")} == {first["name"], second["name"]}
    assert json.loads((results / "versions" / f"{first['name']}.json").read_text()) == first
    assert "Nothing to be done" in snakemake(project, versions, *tiny)

    git(project, "checkout", "-q", "HEAD~1")  # back, to versions that were recorded before
    snakemake(project, versions, *tiny)
    assert recorded()["name"] == first["name"]

    other = project / "scripts" / "numpy-99.0.dist-info"  # found before that of the environment
    other.mkdir()
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: numpy\nVersion: 99.0\n")
    snakemake(project, versions, *tiny)
    assert recorded()["packages"]["numpy"] == "99.0"
