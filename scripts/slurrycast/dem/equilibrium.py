"""Whether and when a DEM run came to rest, judged by its density."""

from dataclasses import dataclass

import numpy as np

BAND = 0.001  # share of the last density within which a run counts as equilibrated


@dataclass(frozen=True)
class Equilibrium:
    """`density_drift` is relative to the last density; the time is in us."""

    density_drift: float
    time_to_equilibrium_us: float


def equilibrium(time_us: np.ndarray, density_g_cm3: np.ndarray) -> Equilibrium:
    """Judge a run by its density (n,) at the times (n,).

    The drift is that of the least-squares line through the last 10 % of the run, over that stretch. Time to equilibrium
    is the first time from which density stays within 0.1 % of its last value.
    """
    relative = density_g_cm3 / density_g_cm3[-1]
    end = time_us >= 0.9 * time_us[-1]
    slope = np.polynomial.Polynomial.fit(time_us[end], relative[end], 1).convert().coef[1]
    outside = np.flatnonzero(np.abs(relative - 1) > BAND)
    first = outside[-1] + 1 if len(outside) else 0
    return Equilibrium(float(slope * np.ptp(time_us[end])), float(time_us[first]))
