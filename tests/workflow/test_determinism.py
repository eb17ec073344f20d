"""Same configuration, same machine, one rank: two fresh runs are equal in all that is not a time."""

import json
from pathlib import Path

import pytest

from checkouts import copy_checkout, snakemake
from torture.comparison import ASIDE, OF_TIME, content

pytestmark = [pytest.mark.slow, pytest.mark.full]

# What the second run is asked for; what is drawn or reported from tables is left out.
TABLES = ["density_volume", "coordinate_errors", "rdf_errors", "equilibrium", "training_range", "noise", "skill"]
TABLES += ["structure_errors", "ablation", "uncertainty"]
# Each of these is there for every slurry, surrogate or table.
FOLDERS = {"dem", "frames", "dataset", "models", "hybrid", "rdf", "perturbed", "structure", "tables"}
# Seconds derive from seconds, as those of OF_TIME.
TIMED = ["cost", "speedup", "front", "equal_cost", "cost_scaling", "article_costs", "relaxation"]
TIMED += ["timestep", "timestep_summary"]


@pytest.fixture(scope="module")
def again(tmp_path_factory) -> Path:
    """The tiny configuration in another checkout, one job after the other."""
    project = copy_checkout(tmp_path_factory.mktemp("again"))
    tables = [f"results/tiny/tables/{name}.csv" for name in TABLES]
    snakemake(project, *tables, "models", "--cores", "1", "--configfile", "config/tiny.yaml")
    return project / "results" / "tiny"


def test_two_fresh_runs_are_equal(evaluation, again):
    """In each file that the second one has made, models by their weights and layers."""
    names = [path.relative_to(again).as_posix() for path in again.rglob("*") if path.is_file()]
    compared = [name for name in names if not OF_TIME.fullmatch(name) and not ASIDE.fullmatch(name)]
    assert {name.partition("/")[0] for name in compared if "/" in name} >= FOLDERS
    assert [name for name in compared if content(evaluation / name) != content(again / name)] == []


def test_every_table_is_compared_or_holds_times(evaluation):
    assert {path.stem for path in (evaluation / "tables").glob("*.csv")} == {*TABLES, *TIMED}


def test_comparison_sees_the_last_bit(results, tmp_path):
    """What the test above would say if one number differed."""
    kept = json.loads((results / "models" / "linear" / "model.json").read_text())
    kept["training_mse_um2"] *= 1 + 2**-52
    (tmp_path / "model.json").write_text(json.dumps(kept, indent=1) + "\n")
    assert content(tmp_path / "model.json") != content(results / "models" / "linear" / "model.json")
