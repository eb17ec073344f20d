"""Whether and when a DEM run reached equilibrium, judged by its density, and what tells how a relaxation ended."""

from dataclasses import dataclass

import numpy as np

BAND = 0.001  # share of the last density within which a run counts as equilibrated


@dataclass(frozen=True)
class Equilibrium:
    """`density_drift` is relative to the last density; the time is in us."""

    density_drift: float
    time_to_equilibrium_us: float


def equilibrium(time_us: np.ndarray, density_g_cm3: np.ndarray) -> Equilibrium:
    """Drift of the density at the end of a run, and time to equilibrium.

    Parameters
    ----------
    time_us, density_g_cm3
        Times (rows,), rising, and the density at each of them.

    Notes
    -----
    The drift is the change over the last 10 % of the run of the least-squares line through them. Time to equilibrium
    is the first time from which density stays within BAND of its last value.
    """
    relative = density_g_cm3 / density_g_cm3[-1]
    end = time_us >= 0.9 * time_us[-1]
    slope = np.polynomial.Polynomial.fit(time_us[end], relative[end], 1).convert().coef[1]
    outside = np.flatnonzero(np.abs(relative - 1) > BAND)
    first = outside[-1] + 1 if len(outside) else 0
    return Equilibrium(float(slope * np.ptp(time_us[end])), float(time_us[first]))
