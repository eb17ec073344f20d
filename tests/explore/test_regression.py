"""Fits, indices and maps of functions that are known."""

import numpy as np
import pytest

from slurrycast.explore.inputs import InputSpace, sobol_points
from slurrycast.explore.maps import grid
from slurrycast.explore.regression import coverage, fit, pooled_sd
from slurrycast.explore.sensitivity import sobol_indices
from slurrycast.explore.targets import nearest

NOISE = 0.02


def known(x: np.ndarray) -> np.ndarray:
    """A function (n,) of the first three of the inputs (n, 5)."""
    return x[:, 0] + 0.5 * x[:, 1] ** 2 + 0.3 * x[:, 0] * x[:, 2]


@pytest.fixture(scope="module")
def fitted():
    """64 points and 5 repetitions at the centre, with noise: inputs, values, mask of the points, and the fit."""
    inputs = np.vstack([sobol_points(64, 5, 1), np.full((5, 5), 0.5)])
    values = known(inputs) + NOISE * np.random.default_rng(1).normal(size=len(inputs))
    alone = np.arange(len(inputs)) < 64
    return inputs, values, alone, fit(inputs, values, alone, 1)


def test_a_known_function_is_found_again_with_its_noise(fitted):
    _, values, alone, model = fitted
    x = np.random.default_rng(2).random((500, 5))
    mean, half = model.interval(x)
    assert np.sqrt(np.mean((mean - known(x)) ** 2)) < NOISE
    new = known(x) + NOISE * np.random.default_rng(3).normal(size=len(x))
    assert 0.85 <= np.mean(np.abs(new - mean) <= half) <= 0.97
    error = (values - model.left_out)[alone]
    assert np.sqrt(np.mean(error**2)) < 1.5 * NOISE
    assert all(
        0.8 <= share <= 0.97 for share in coverage(values[alone], model.left_out[alone], model.left_out_sd[alone])
    )
    _, total = sobol_indices(model.mean, 5, 1)
    assert list(np.argsort(-total)[:2]) == [0, 1] and (total[3:] < 0.02).all()


def test_sensitivity_to_one_input_and_to_none():
    assert sobol_indices(lambda x: x[:, 0] ** 2, 1, 1) == (1, 1)
    for dimensions in (1, 3):
        assert np.isnan(sobol_indices(lambda x: np.full(len(x), 2.0), dimensions, 1)).all()


def test_left_out_is_what_a_fit_without_the_point_expects(fitted):
    """With the same kernel."""
    from sklearn.gaussian_process import GaussianProcessRegressor

    inputs, values, _, model = fitted
    scaled = (values - values.mean()) / values.std()
    for place in (0, 17, 63):
        others = np.arange(len(values)) != place
        alone = GaussianProcessRegressor(model.process.kernel_, alpha=1e-10, optimizer=None).fit(
            inputs[others], scaled[others]
        )
        mean, sd = alone.predict(inputs[[place]], return_std=True)
        assert model.left_out[place] == pytest.approx(values.mean() + values.std() * mean[0], abs=1e-6)
        assert model.left_out_sd[place] == pytest.approx(values.std() * sd[0], rel=1e-4)


@pytest.mark.parametrize("values", [np.ones(20), np.random.default_rng(1).normal(size=20)], ids=["constant", "noise"])
def test_properties_that_no_input_matters_for(values):
    model = fit(sobol_points(20, 2, 1), values, np.ones(20, dtype=bool), 1)
    mean, half = model.interval(sobol_points(50, 2, 2))
    assert np.isfinite([mean, half]).all() and np.ptp(mean) <= np.ptp(values)


def test_intervals_are_calibrated_on_the_others():
    """Errors of twice the sd that is given: 59 % within its interval, 90 % within that of twice the width."""
    error = 2 * np.random.default_rng(1).normal(size=2000)
    as_given, calibrated = coverage(error, np.zeros(2000), np.ones(2000))
    assert as_given == pytest.approx(0.59, abs=0.02)
    assert calibrated == pytest.approx(0.90, abs=0.015)


def test_pooled_sd_of_repetitions():
    values = np.array([1.0, 5.0, 3.0, 10.0, 12.0, 7.0])
    sd, freedom = pooled_sd(values, np.array([0, 1, 0, 2, 2, 3]))
    assert (sd, freedom) == (pytest.approx(np.sqrt((2 + 2) / 2)), 2)
    assert pooled_sd(values, np.arange(6)) == (pytest.approx(np.nan, nan_ok=True), 0)


def test_indices_of_the_ishigami_function():
    """Known: Saltelli et al., Global Sensitivity Analysis (2008), with a = 7 and b = 0.1."""

    def ishigami(unit: np.ndarray) -> np.ndarray:
        x = (2 * unit - 1) * np.pi
        return np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])

    first, total = sobol_indices(ishigami, 3, 1)
    assert first == pytest.approx([0.3139, 0.4424, 0.0], abs=0.01)
    assert total == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.01)


def test_a_map_leaves_out_what_lies_beyond_the_last_mass_fraction():
    shares = {"mass_fraction_A": (0.1, 0.3), "mass_fraction_B": (0.4, 0.6), "mass_fraction_C": (0.2, 0.4)}
    space = InputSpace.of_ranges(shares | {"size_factor_A": (1.0, 2.0)}, 1.0)
    inputs, inside = grid(space, "mass_fraction_A", "mass_fraction_B", 5)
    assert inputs[:, :3].sum(axis=1) == pytest.approx(np.ones(25))
    assert (inputs[:, 3] == 1.5).all()
    assert list(inside) == [0.2 - 1e-9 <= 1 - a - b <= 0.4 + 1e-9 for a, b in inputs[:, :2]]


def test_nearest_recipes_are_not_alike():
    points = np.array([[0.0], [0.1], [0.5], [0.9], [1.0]])
    assert nearest(np.array([2.0, 1.0, 3.0, 0.5, 0.4]), points, 3, apart=0.3) == [4, 1, 2]
