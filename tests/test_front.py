"""Error against cost: known fronts, and the hurried DEM at equal cost."""

import json
import subprocess
from dataclasses import asdict

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slurrycast.costs import Cost
from slurrycast.front import (
    at_equal_cost,
    front,
    is_reference,
    mean_front,
    non_dominated,
    replica_band,
    structure_error_columns,
)
from slurrycast.tables import read_table

POINTS = st.lists(st.tuples(st.integers(1, 6), st.integers(1, 6)), min_size=1, max_size=12)


def structure_errors(rows: list[tuple]) -> pd.DataFrame:
    """tables/structure_errors.csv with these rows."""
    columns = ["surrogate", "slurry", "stage", "quantity", "value", "dem_value", "replica_sd"]
    return pd.DataFrame(rows, columns=columns)


ERRORS = structure_errors(
    [
        ("affine", "2", "predicted", "density_g_cm3", 1.0, 2.0, 0.01),
        ("affine", "2", "relaxed", "density_g_cm3", 1.9, 2.0, 0.01),
        ("affine", "2", "relaxed", "rdf_all", 0.02, 0.0, 0.015),
        ("affine", "2", "relaxed", "rdf_NiO-8YSZ", 0.5, 0.0, 0.03),
        ("affine", "6", "relaxed", "density_g_cm3", 2.2, 2.0, 0.02),
        ("affine", "6", "relaxed", "rdf_all", 0.04, 0.0, 0.005),
    ]
)


def test_errors_are_those_of_the_relaxed_structures():
    rows = structure_error_columns(ERRORS)
    assert list(rows.slurry) == ["2", "6"]
    np.testing.assert_allclose(rows.density_error, [0.05, 0.1])
    np.testing.assert_allclose(rows.rdf_error, [0.02, 0.04])


def test_front_is_cost_beside_error():
    speedup = pd.DataFrame(
        {"surrogate": "affine", "slurry": ["2", "6", "N1"], "hybrid": [2.0, 3.0, 1.0], "dem": [20.0, 60.0, np.nan]}
    )
    rows = front(speedup, ERRORS, {"affine": 10})
    columns = ["surrogate", "input_last_frame", "slurry", "cost_share_of_full_dem", "density_error", "rdf_error"]
    assert list(rows.columns) == columns
    assert list(rows.input_last_frame) == [10, 10]
    np.testing.assert_allclose(rows.cost_share_of_full_dem, [0.1, 0.05])


def test_replica_band_is_two_sd_of_the_density_and_the_rdf_spread():
    band = replica_band(ERRORS, {"2", "6"})
    assert band == pytest.approx({"density_error": (2 * 0.005 + 2 * 0.01) / 2, "rdf_error": 0.01})
    assert all(np.isnan(value) for value in replica_band(ERRORS.assign(replica_sd=np.nan), {"2"}).values())


def test_means_are_over_the_same_slurries():
    keys = {"surrogate": ["b", "b", "a"], "input_last_frame": [10, 10, 2], "slurry": ["2", "6", "2"]}
    costs = {"cost_share_of_full_dem": [0.2, 0.9, 0.1], "density_error": [0.01, 0.5, 0.02], "rdf_error": 0.1}
    rows = mean_front(pd.DataFrame(keys | costs))
    assert list(rows.surrogate) == ["a", "b"]
    np.testing.assert_allclose(rows.density_error, [0.02, 0.01])


def test_known_front():
    cost = [1, 2, 3, 4, 2]
    error = [5, 3, 3, 1, 4]
    assert non_dominated(cost, error).tolist() == [True, True, False, True, False]


@given(POINTS)
def test_every_point_is_on_the_front_or_behind_one_that_is(points):
    cost, error = np.array(points).T
    on_front = non_dominated(cost, error)
    assert on_front.any()
    for c, e, on in zip(cost, error, on_front, strict=True):
        behind = [(c2, e2) for c2, e2 in points if c2 <= c and e2 <= e and (c2, e2) != (c, e)]
        assert on == (not behind)
        assert on or any(on_front[points.index(other)] for other in behind)


def front_rows(rows: list[tuple]) -> pd.DataFrame:
    """tables/front.csv of slurry 2."""
    table = pd.DataFrame(rows, columns=["surrogate", "input_last_frame", "cost_share_of_full_dem", "density_error"])
    return table.assign(slurry="2", rdf_error=2 * table.density_error)


def test_equal_cost_is_half_way_in_the_logarithm():
    points = front_rows(
        [
            ("early_dem_x2", 10, 0.4, 0.01),
            ("early_dem_x32", 10, 0.1, 0.03),
            ("early_dem_x2_f02", 2, 0.3, 0.05),
            ("net", 10, 0.2, 0.07),
            ("affine", 10, 0.05, 0.02),
            ("vgg16", 10, 0.5, 0.02),
            ("affine_f01", 1, 0.04, 0.02),
            ("affine_f02", 2, 0.3, 0.02),
        ]
    )
    mse_um2 = [0.05, 0.07, 0.09, 0.06, 0.08, 0.1, 0.11]
    skill = pd.DataFrame({"surrogate": points.surrogate[:7], "slurry": "2", "mse_um2": mse_um2})
    rows = at_equal_cost(points, skill).set_index("surrogate")
    assert list(rows.index) == ["net", "affine", "vgg16", "affine_f01", "affine_f02"]
    net = rows.loc["net"]
    assert (net.mse_um2, net.early_dem_mse_um2) == pytest.approx((0.06, 0.06))
    assert (net.density_error, net.early_dem_density_error) == pytest.approx((0.07, 0.02))
    assert (net.rdf_error, net.early_dem_rdf_error) == pytest.approx((0.14, 0.04))
    assert list(rows.note) == [
        "",
        "cheaper than any early_dem",
        "dearer than any early_dem",
        "no early_dem from this frame",
        "",
    ]
    assert rows.early_dem_density_error.isna().tolist() == [False, True, True, True, False]
    # at the very cost of the only one from frame 2; without an MSE of its own
    assert rows.early_dem_density_error["affine_f02"] == pytest.approx(0.05)
    assert np.isnan(rows.mse_um2["affine_f02"])


def test_which_labels_are_the_hurried_dem():
    assert [is_reference(label) for label in ("early_dem", "early_dem_x2_f01", "early_demons", "affine")] == [
        True,
        True,
        False,
        False,
    ]


def test_the_tables_are_written(tmp_path, command):
    """compute_front and compare_at_equal_cost, from the records of one slurry that is flat half-way."""
    segments = [{"step_start": 0, "step_end": 1200, "wall_s": 240.0, "cpu_s": 120.0}]
    run = {"slurry": "2", "start": {"wall_s": 9.0, "cpu_s": 0.0}, "segments": segments, "steps": 1200}
    run |= {"frames_written": 121, "physics": {"dem": {"steps": 1200, "frames": 121}}}
    (tmp_path / "run.json").write_text(json.dumps(run))
    records = [Cost("generate_inputs", "-", "2", cpu_s=5.0), Cost("extract_frames", "-", "2", cpu_s=1.0)]
    stages = ("predict_slurry", "wrap_slurry", "relax_slurry")
    records += [Cost(stage, label, "2", cpu_s=1.0) for label in ("affine", "affine_f02") for stage in stages]
    costs = [tmp_path / f"{place}.json" for place in range(len(records))]
    for path, record in zip(costs, records, strict=True):
        path.write_text(json.dumps(asdict(record)))
    equilibrium = {"slurry": ["2"], "role": "test", "particles": 100, "time_to_equilibrium_us": 60.0}
    pd.DataFrame(equilibrium | {"run_time_us": 120.0, "warning": ""}).to_csv(tmp_path / "equilibrium.csv", index=False)
    both = pd.concat([ERRORS, ERRORS.assign(surrogate="affine_f02")])
    both.to_csv(tmp_path / "structure_errors.csv", index=False)
    skill = {"surrogate": ["affine", "affine_f02"], "slurry": "2", "mse_um2": [0.08, 0.09]}
    pd.DataFrame(skill).to_csv(tmp_path / "skill.csv", index=False)
    tables = {name: tmp_path / f"{name}.csv" for name in ("equilibrium", "structure_errors", "front", "equal", "skill")}
    for words in (
        command(
            "compute_front",
            costs=costs,
            equilibrium=tables["equilibrium"],
            run_json=tmp_path / "run.json",
            structure_errors=tables["structure_errors"],
            input_steps=["affine=100", "affine_f02=20"],
            table=tables["front"],
        ),
        command("compare_at_equal_cost", front=tables["front"], skill=tables["skill"], table=tables["equal"]),
    ):
        subprocess.run(words, check=True)
    rows = read_table(tables["front"])
    assert list(rows.surrogate) == ["affine", "affine_f02"]
    assert list(rows.input_last_frame) == [10, 2]
    # inputs, DEM to the frame, features (the only record is its own bound) and three seconds, over inputs and DEM
    np.testing.assert_allclose(rows.cost_share_of_full_dem, [(5 + 10 + 1 + 3) / 125, (5 + 2 + 1 + 3) / 125])
    np.testing.assert_allclose(rows.density_error, 0.05)
    equal = read_table(tables["equal"])
    assert list(equal.mse_um2) == [0.08, 0.09]
    assert set(equal.note) == {"no early_dem from this frame"}
