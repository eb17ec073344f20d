"""A LAMMPS that cannot do what the workflow asks of it is refused before any job."""

import pytest

from checkouts import copy_checkout, snakemake

OLD = """#!/bin/sh
echo 'Large-scale Atomic/Molecular Massively Parallel Simulator - 23 Jun 2022'
"""


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A checkout with an old LAMMPS."""
    folder = copy_checkout(tmp_path_factory.mktemp("project"))
    (folder / "old_lmp").write_text(OLD)
    (folder / "old_lmp").chmod(0o755)
    return folder


@pytest.mark.parametrize(
    ("executable", "says"),
    [
        ("./old_lmp", "dem.executable: './old_lmp' is LAMMPS 23 Jun 2022: must be 2 Aug 2023 or newer"),
        ("no_lmp", "dem.executable: 'no_lmp' is not on PATH; give the name or path of an existing program"),
        ("true", "dem.executable: 'true' does not answer -h as LAMMPS does: it printed nothing"),
        ("false", "dem.executable: 'false' -h ended with exit code 1: it printed nothing"),
    ],
)
def test_unfit_lammps_is_refused_before_any_job(project, executable, says):
    (project / "own.yaml").write_text(f"dem: {{executable: {executable!r}}}\n")
    files = ("--configfile", "config/tiny.yaml", "own.yaml")
    said = snakemake(project, "slurries", *files, fails=True)
    assert said.count(says) == 1
    assert "Traceback" not in said
    assert not (project / "results").exists()


def test_ranks_without_a_launcher_are_refused_before_any_job(project):
    settings = ("--configfile", "config/tiny.yaml", "--set-resources", "run_slurry:tasks=2")
    said = snakemake(project, "slurries", *settings, fails=True)
    assert said.count("dem.launcher: '' is no command; give a program, with options if it needs some") == 1
    assert "Traceback" not in said
    assert not (project / "results").exists()


def test_lammps_is_not_asked_for_where_none_is_started(project):
    (project / "own.yaml").write_text("dem: {executable: no_lmp}\n")
    files = ("--configfile", "config/tiny.yaml", "own.yaml")
    snakemake(project, "slurries", "--dry-run", *files)
    snakemake(project, "results/tiny/config.yaml", *files)
