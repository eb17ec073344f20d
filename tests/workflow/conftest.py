"""The tiny configuration, run once with real LAMMPS and real Keras for all tests that look at it."""

from pathlib import Path

import pytest

from checkouts import copy_checkout, snakemake

TINY = ("--configfile", "config/tiny.yaml")


@pytest.fixture(scope="session")
def project(tmp_path_factory) -> Path:
    """A checkout in a folder whose name has spaces and letters beyond ASCII."""
    return copy_checkout(tmp_path_factory.mktemp("a pröject in ünïcode"))


@pytest.fixture(scope="session")
def results(project) -> Path:
    """Results of the tiny configuration."""
    snakemake(project, *TINY)
    return project / "results" / "tiny"


@pytest.fixture(scope="session")
def evaluation(project, results) -> Path:
    """The same results with the evaluation, also of tapes, and the study of the time step, made after the main job."""
    snakemake(project, "evaluation", "convergence", "tapes", "tape_evaluation", *TINY)
    return results
