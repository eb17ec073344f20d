"""Same configuration, same machine, one rank: two fresh runs are equal in all that is not a time."""

import json
from pathlib import Path

import pytest

from checkouts import copy_checkout, snakemake
from torture.comparison import content

pytestmark = pytest.mark.slow

# Each of these is there for every slurry, surrogate or table; what is drawn or reported from tables is left out.
KINDS = (
    "dem/*/initial.data",
    "dem/*/coefficients.lmp",
    "dem/*/push_off.lmp",
    "dem/*/inputs.json",
    "dem/*/thermo.csv",
    "dem/*/frame_*.restart",
    "frames/*.h5",
    "dataset/training.h5",
    "dataset/packing_fraction.json",
    "models/*/model.json",
    "models/*/model.keras",  # compared by weights and layers: it holds times
    "models/*/history.csv",
    "models/*/calibration.json",
    "hybrid/*/*/predicted.h5",
    "hybrid/*/*/wrapped.data",
    "hybrid/*/*/relaxed.data",
    "hybrid/*/*/relaxed.h5",
    "rdf/*/*.csv",
    "perturbed/*.h5",
    "structure/*/*.csv",
    "tables/*.csv",
)
# Seconds, and what derives from them.
TIMED = {
    "cost.csv",
    "speedup.csv",
    "front.csv",
    "equal_cost.csv",
    "cost_scaling.csv",
    "article_costs.csv",
    "relaxation.csv",
    "timestep.csv",
    "timestep_summary.csv",
}
UNTIMED = (
    "density_volume",
    "coordinate_errors",
    "rdf_errors",
    "equilibrium",
    "training_range",
    "noise",
    "skill",
    "structure_errors",
    "ablation",
    "uncertainty",
)


@pytest.fixture(scope="module")
def again(tmp_path_factory) -> Path:
    """The tiny configuration in another checkout, one job after the other."""
    project = copy_checkout(tmp_path_factory.mktemp("again"))
    tables = [f"results/tiny/tables/{name}.csv" for name in UNTIMED]
    snakemake(project, *tables, "models", "--cores", "1", "--configfile", "config/tiny.yaml")
    return project / "results" / "tiny"


@pytest.mark.parametrize("kind", KINDS)
def test_two_fresh_runs_are_equal(evaluation, again, kind):
    names = [
        {str(path.relative_to(run)) for path in run.glob(kind) if path.name not in TIMED} for run in (evaluation, again)
    ]
    compared = sorted(set.intersection(*names))
    assert compared and names[1] <= names[0]
    different = [name for name in compared if content(evaluation / name) != content(again / name)]
    assert different == []


def test_every_table_is_compared_or_holds_times(evaluation, again):
    found = {path.name for path in (evaluation / "tables").glob("*.csv")} - TIMED
    assert found == {path.name for path in (again / "tables").glob("*.csv")}


def test_comparison_sees_the_last_bit(results, tmp_path):
    """What the test above would say if one number differed."""
    kept = json.loads((results / "models" / "linear" / "model.json").read_text())
    kept["training_mse_um2"] *= 1 + 2**-52
    (tmp_path / "model.json").write_text(json.dumps(kept, indent=1) + "\n")
    assert content(tmp_path / "model.json") != content(results / "models" / "linear" / "model.json")
