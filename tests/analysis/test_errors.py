"""Coordinate errors against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from slurrycast.analysis.errors import AXES, coordinate_errors, true_box_errors

shifts = arrays(np.float64, 3, elements=st.floats(-100, 100))


@pytest.fixture(scope="module")
def target() -> np.ndarray:
    """Coordinates (500, 3) in a box of 8, 8 and 16 um about the origin."""
    return np.random.default_rng(3).uniform(-0.5, 0.5, (500, 3)) * [8.0, 8.0, 16.0]


@pytest.fixture(scope="module")
def predicted(target) -> np.ndarray:
    """The target with random errors of different size per axis."""
    return target + np.random.default_rng(4).normal(0, [0.1, 0.2, 0.3], target.shape)


def test_by_hand():
    # x: deviations -1, +1, -1, +1 of targets -3, -1, 1, 3; y and z are exact.
    target = np.array([[-3.0, 0, 1], [-1, 1, 0], [1, 0, -1], [3, -1, 0]])
    predicted = target + np.array([[-1.0, 0, 0], [1, 0, 0], [-1, 0, 0], [1, 0, 0]])
    errors = coordinate_errors(target, predicted)
    assert tuple(errors) == AXES
    assert vars(errors["x"]) == pytest.approx({"mse_um2": 1, "mae_um": 1, "r2": 1 - 4 / 20})
    for axis in "yz":
        assert vars(errors[axis]) == {"mse_um2": 0, "mae_um": 0, "r2": 1}
    # Pooled: 4 um2 over 12 coordinates; the targets' sums of squares are 20, 2 and 2.
    assert vars(errors["all"]) == pytest.approx({"mse_um2": 1 / 3, "mae_um": 1 / 3, "r2": 1 - 4 / 24})


def test_the_mean_as_prediction_has_r2_zero(target):
    errors = coordinate_errors(target, np.zeros_like(target))
    for index, axis in enumerate("xyz"):
        assert errors[axis].r2 == pytest.approx(0, abs=1e-12)
        assert errors[axis].mse_um2 == pytest.approx(np.var(target[:, index]))
    assert errors["all"].r2 == pytest.approx(0, abs=1e-12)


def test_r2_is_one_less_mse_over_variance(target, predicted):
    errors = coordinate_errors(target, predicted)
    for index, axis in enumerate("xyz"):
        assert errors[axis].r2 == pytest.approx(1 - errors[axis].mse_um2 / np.var(target[:, index]))
    assert errors["all"].mse_um2 == pytest.approx(np.mean([errors[axis].mse_um2 for axis in "xyz"]))
    assert errors["all"].mae_um == pytest.approx(np.mean([errors[axis].mae_um for axis in "xyz"]))
    assert errors["all"].r2 == pytest.approx(1 - errors["all"].mse_um2 / np.mean(np.var(target, axis=0)))


@given(shift=shifts, other_shift=shifts)
def test_common_shifts_do_not_count(target, predicted, shift, other_shift):
    shifted = coordinate_errors(target + shift, predicted + other_shift)
    for axis, error in coordinate_errors(target, predicted).items():
        assert vars(shifted[axis]) == pytest.approx(vars(error), rel=1e-9, abs=1e-12)


@given(factor=arrays(np.float64, 3, elements=st.floats(0.5, 2)), shift=shifts)
def test_an_affine_prediction_has_no_error_in_the_true_box(target, factor, shift):
    edges = np.array([8.0, 8.0, 16.0])
    for error in true_box_errors(target, target * factor + shift, edges, edges * factor).values():
        assert vars(error) == pytest.approx({"mse_um2": 0, "mae_um": 0, "r2": 1}, abs=1e-10)


def test_equal_boxes_make_both_the_same(target, predicted):
    edges = np.array([8.0, 8.0, 16.0])
    assert true_box_errors(target, predicted, edges, edges) == coordinate_errors(target, predicted)
