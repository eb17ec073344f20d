"""Error against cost: known fronts, and the DEM with a faster barostat at equal cost."""

import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from script_runs import write_costs, written
from slurrycast.evaluation.front import (
    at_equal_cost,
    equilibrium_share,
    front,
    is_reference,
    mean_front,
    non_dominated,
    on_front,
    replica_band,
    structure_error_columns,
    with_relative_mse,
)
from slurrycast.runtime.costs import Cost

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


def test_relative_mse_is_that_of_each_slurry_and_goes_into_the_means():
    keys = {"surrogate": ["net", "net", "affine"], "input_last_frame": 10, "slurry": ["2", "6", "2"]}
    errors = {"cost_share_of_full_dem": [0.2, 0.9, 0.1], "density_error": 0.01, "rdf_error": 0.1}
    skill = {"surrogate": ["net", "affine", "net", "far"], "slurry": ["2", "2", "6", "6"]}
    skill |= {"mse_um2": [0.2, 0.1, np.nan, 3.0], "mse_affine_um2": 0.1}
    rows = with_relative_mse(pd.DataFrame(keys | errors), pd.DataFrame(skill))
    assert list(zip(rows.surrogate, rows.slurry, strict=True)) == [("net", "2"), ("net", "6"), ("affine", "2")]
    np.testing.assert_allclose(rows.mse_of_affine, [2, np.nan, 1])
    means = mean_front(rows)
    assert list(means.surrogate) == ["affine", "net"]
    np.testing.assert_allclose(means.mse_of_affine, [1, 2])
    everywhere = mean_front(rows[rows.surrogate == "net"])
    assert np.isnan(everywhere.mse_of_affine[0]) and everywhere.density_error[0] == 0.01


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


def equal_cost(points: list[tuple], mse_um2: dict[str, float]) -> pd.DataFrame:
    """Rows of tables/equal_cost.csv by surrogate."""
    skill = pd.DataFrame({"surrogate": list(mse_um2), "slurry": "2", "mse_um2": list(mse_um2.values())})
    return at_equal_cost(front_rows(points), skill).set_index("surrogate")


EARLY = [("early_dem_x2", 10, 0.4, 0.01), ("early_dem_x32_f02", 2, 0.1, 0.03)]
EARLY_MSE_UM2 = {"early_dem_x2": 0.05, "early_dem_x32_f02": 0.07}


def test_equal_cost_is_half_way_in_the_logarithm_whatever_the_input_frames():
    others = [("net", 10, 0.2, 0.07), ("affine_f01", 1, 0.4, 0.02)]
    rows = equal_cost([*EARLY, *others], EARLY_MSE_UM2 | {"net": 0.06})
    assert list(rows.index) == ["net", "affine_f01"]
    net = rows.loc["net"]
    assert (net.mse_um2, net.early_dem_mse_um2) == pytest.approx((0.06, 0.06))
    assert (net.density_error, net.early_dem_density_error) == pytest.approx((0.07, 0.02))
    assert (net.rdf_error, net.early_dem_rdf_error) == pytest.approx((0.14, 0.04))
    # at the very cost of one of them; without an MSE of its own
    assert rows.early_dem_density_error["affine_f01"] == pytest.approx(0.01)
    assert np.isnan(rows.mse_um2["affine_f01"])
    np.testing.assert_allclose(rows.early_dem_cost_share, rows.cost_share_of_full_dem)
    assert list(rows.note) == ["", ""]


# Dearer than those of EARLY, with a larger error
WORSE = [("early_dem_x3_f05", 5, 0.2, 0.001), ("early_dem_x1", 10, 0.6, 0.002)]


@pytest.mark.parametrize(
    ("further", "further_mse_um2", "costs", "early_costs", "notes"),
    [
        ([], {}, (0.05, 0.5), (0.1, 0.4), ["cheaper than any early_dem", "dearer than any early_dem"]),
        (WORSE, {"early_dem_x3_f05": 0.2, "early_dem_x1": 0.3}, (0.2, 0.6), (0.2, 0.6), ["", ""]),
    ],
)
def test_beside_is_the_nearest_dem_that_one_would_take(further, further_mse_um2, costs, early_costs, notes):
    others = [("affine", 10, costs[0], 0.02), ("vgg16", 10, costs[1], 0.02)]
    rows = equal_cost([*EARLY, *further, *others], EARLY_MSE_UM2 | further_mse_um2)
    assert list(rows.note) == notes
    np.testing.assert_allclose(rows.early_dem_cost_share, early_costs)
    # the errors are those of the one with the lowest MSE, all of them
    np.testing.assert_allclose(rows.early_dem_mse_um2, [0.07, 0.05])
    np.testing.assert_allclose(rows.early_dem_density_error, [0.03, 0.01])


def test_the_full_dem_is_on_the_front():
    cost, error = np.array([0.1, 0.9, 1.0, 1.2]), np.array([0.5, 0.1, 0.05, 0.01])
    assert on_front(cost, error).tolist() == [True, True, False, False]


def test_share_of_the_dem_to_equilibrium():
    rows = [("a", "1", "cpu_s", 4.0), ("a", "2", "cpu_s", 6.0), ("a", "3", "cpu_s", np.nan)]
    rows += [("b", "1", "cpu_s", 4.0), ("a", "V1", "cpu_s", 9.0), ("a", "1", "wall_s", 1.0)]
    speedup = pd.DataFrame(rows, columns=["surrogate", "slurry", "clock", "dem_to_equilibrium"]).assign(dem=10.0)
    assert equilibrium_share(speedup, {"1", "2", "3"}, "cpu_s") == pytest.approx(0.5)
    assert np.isnan(equilibrium_share(speedup, {"3"}, "cpu_s"))


def test_which_labels_are_the_dem_with_a_faster_barostat():
    labels = ("early_dem", "early_dem_x2_f01", "early_demons", "affine")
    assert [is_reference(label) for label in labels] == [True, True, False, False]


def test_the_tables_are_written(tmp_path):
    """compute_front and compare_at_equal_cost, from the records of one slurry that is flat half-way."""
    segments = [{"step_start": 0, "step_end": 1200, "wall_s": 240.0, "cpu_s": 120.0}]
    run = {"slurry": "2", "start": {"wall_s": 9.0, "cpu_s": 0.0}, "segments": segments, "steps": 1200}
    run |= {"frames_written": 121, "physics": {"dem": {"steps": 1200, "frames": 121}}}
    (tmp_path / "run.json").write_text(json.dumps(run))
    records = [Cost("generate_inputs", "-", "2", cpu_s=5.0), Cost("extract_frames", "-", "2", cpu_s=1.0)]
    stages = ("predict_slurry", "wrap_slurry", "relax_slurry")
    records += [Cost(stage, label, "2", 100, cpu_s=1.0) for label in ("affine", "affine_f02") for stage in stages]
    costs = write_costs(tmp_path, records)
    equilibrium = {"slurry": ["2"], "role": "test", "particles": 100, "time_to_equilibrium_us": 60.0}
    pd.DataFrame(equilibrium | {"run_time_us": 120.0, "warning": ""}).to_csv(tmp_path / "equilibrium.csv", index=False)
    both = pd.concat([ERRORS, ERRORS.assign(surrogate="affine_f02")])
    both.to_csv(tmp_path / "structure_errors.csv", index=False)
    skill = {"surrogate": ["affine", "affine_f02"], "slurry": "2", "mse_um2": [0.08, 0.09]}
    pd.DataFrame(skill).to_csv(tmp_path / "skill.csv", index=False)
    tables = {name: tmp_path / f"{name}.csv" for name in ("equilibrium", "structure_errors")}
    steps = ["affine=100", "affine_f02=20"]
    options = {"costs": costs, **tables, "run_json": tmp_path / "run.json", "input_steps": steps}
    rows = written("compute_front", tmp_path / "front.csv", **options)
    assert list(rows.surrogate) == ["affine", "affine_f02"]
    assert list(rows.input_last_frame) == [10, 2]
    # inputs, DEM to the frame, features (the only record is its own bound) and three seconds, over inputs and DEM
    np.testing.assert_allclose(rows.cost_share_of_full_dem, [(5 + 10 + 1 + 3) / 125, (5 + 2 + 1 + 3) / 125])
    np.testing.assert_allclose(rows.density_error, 0.05)
    skills = {"front": tmp_path / "front.csv", "skill": tmp_path / "skill.csv"}
    equal = written("compare_at_equal_cost", tmp_path / "equal.csv", **skills)
    assert list(equal.mse_um2) == [0.08, 0.09]
    assert set(equal.note) == {"no early_dem of this slurry"}
