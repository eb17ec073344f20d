"""The fit of a power law: laws with a known exponent, and the regression of scipy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import linregress

from slurrycast.evaluation.power_law import power_law


@given(st.floats(-2, 2), st.floats(1e-3, 1e3))
def test_power_law_gives_its_exponent(exponent, factor):
    x = np.array([355.0, 710, 923, 1775])
    found, standard_error = power_law(x, factor * x**exponent)
    assert found == pytest.approx(exponent, abs=1e-9)
    assert standard_error == pytest.approx(0, abs=1e-9)


def test_power_law_is_that_of_scipy():
    rng = np.random.default_rng(1)
    x = rng.uniform(100, 2000, 12)
    y = 3 * x**0.3 * rng.lognormal(sigma=0.05, size=12)
    known = linregress(np.log(x), np.log(y))
    assert power_law(x, y) == pytest.approx((known.slope, known.stderr))


def test_power_law_of_equal_values():
    x = np.array([1.0, 2.6, 5])
    assert power_law(x, np.full(3, 0.1)) == (0, 0)
    assert np.isnan(power_law(np.full(3, 0.1), x)).all()
    assert np.isnan(power_law(np.array([]), np.array([]))).all()
    exponent, standard_error = power_law(x[:2], x[:2])
    assert exponent == pytest.approx(1)
    assert np.isnan(standard_error)
