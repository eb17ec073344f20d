"""Snakemake called from another folder, and results in another folder: as Snakemake users know both."""

import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from configurations import HEADER, ROOT, load

pytestmark = pytest.mark.slow
INPUTS = "results/{run}/dem/{slurry}/inputs.json"


def snakemake(folder: Path, *arguments: str | Path) -> str:
    """Run Snakemake in `folder`; return all that it prints."""
    command = [sys.executable, Path(sys.executable).with_name("snakemake"), "--cores", "2", *arguments]
    done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert done.returncode == 0, done.stdout[-5000:]
    return done.stdout


def test_every_job_can_be_planned_for_another_folder(tmp_path):
    """All inputs that are files of the project are found; the shipped configuration names a table of the project."""
    config = ROOT / "config" / "tiny.yaml"
    arguments = ["--dry-run", "--configfile", config, "--", "all", "evaluation", "convergence"]
    planned = snakemake(tmp_path, "--snakefile", ROOT / "Snakefile", *arguments)
    assert "write_evaluation" in planned
    assert not (tmp_path / "config").exists()


def test_results_go_to_the_working_directory(tmp_path):
    """With --directory and with --snakefile; paths of a user's configuration start at the working directory."""
    target = INPUTS.format(run="tiny", slurry="T1")
    snakemake(ROOT, "--directory", tmp_path / "data", "--configfile", "config/tiny.yaml", "--", target)
    assert (tmp_path / "data" / target).is_file()

    (tmp_path / "my_slurries.tsv").write_text(f"{HEADER}A\ttest\t1\t1.0\t1\nB\ttrain\t1\t1.0\t2\n")
    (tmp_path / "my.yaml").write_text(
        yaml.safe_dump(load("tiny") | {"run": {"name": "my"}, "slurries": "my_slurries.tsv"})
    )
    target = INPUTS.format(run="my", slurry="A")
    snakemake(tmp_path, "--snakefile", ROOT / "Snakefile", "--configfile", "my.yaml", "--", target)
    assert (tmp_path / target).is_file()
