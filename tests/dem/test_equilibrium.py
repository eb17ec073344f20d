"""Density drift and time to equilibrium against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slurrycast.dem.equilibrium import BAND, equilibrium

TIME_US = np.linspace(0, 120, 1201)  # a row every 0.1 us


def test_constant_density_was_in_equilibrium_from_the_start():
    found = equilibrium(TIME_US, np.full(len(TIME_US), 2.24))
    assert found.density_drift == pytest.approx(0, abs=1e-12)
    assert found.time_to_equilibrium_us == 0


@given(st.floats(-0.01, 0.01))
def test_linear_drift(slope):
    """rho = 2 + slope t: over the last 12 us it changes by 12 slope, relative to the last value."""
    density = 2 + slope * TIME_US
    found = equilibrium(TIME_US, density)
    assert found.density_drift == pytest.approx(12 * slope / density[-1], rel=1e-9, abs=1e-12)
    # |rho - rho_end| = |slope| (120 - t) is within the band from t = 120 - band rho_end / |slope| on
    from_us = 120 - BAND * density[-1] / max(abs(slope), 1e-12)
    assert max(from_us, 0) - 1e-6 <= found.time_to_equilibrium_us <= max(from_us, 0) + 0.1 + 1e-6


@pytest.mark.parametrize("tau_us", [3.0, 10.0])
def test_exponential_approach(tau_us):
    """rho = rho_end (1 - a e^(-t/tau)): within the band from t = tau ln(a / band) on, if e^(-120/tau) is small."""
    share = 0.7
    density = 2.24 * (1 - share * np.exp(-TIME_US / tau_us))
    found = equilibrium(TIME_US, density)
    expected_us = tau_us * np.log(share / (BAND + share * np.exp(-120 / tau_us)))
    assert found.time_to_equilibrium_us == pytest.approx(expected_us, abs=0.11)
    assert found.density_drift >= 0
    # below the change over the last 10 % itself, since the line is fitted through a flattening curve
    assert found.density_drift <= share * np.exp(-108 / tau_us)


def test_slow_approach_is_seen_in_the_drift():
    density = 2.24 * (1 - np.exp(-TIME_US / 60))
    assert equilibrium(TIME_US, density).density_drift > 0.02


def test_noise_is_no_drift():
    density = 2.24 + np.random.default_rng(1).normal(scale=0.0003, size=len(TIME_US))
    assert abs(equilibrium(TIME_US, density).density_drift) < 2e-4


def test_late_excursion_counts():
    density = np.full(len(TIME_US), 2.24)
    density[1000] = 2.25
    assert equilibrium(TIME_US, density).time_to_equilibrium_us == pytest.approx(100.1)


def test_run_that_never_settled_settles_at_its_last_row_only():
    density = np.linspace(1, 2, 11)
    assert equilibrium(np.arange(11.0), density).time_to_equilibrium_us == 10
