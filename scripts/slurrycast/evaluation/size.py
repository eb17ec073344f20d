"""What the size of a slurry changes: how fast its box shrinks, and how far its coordinates reach. Pure numpy."""

import numpy as np

SHRUNK_SHARE = 0.75  # a box edge of this share of its start marks how fast a run shrinks


def shrink_time_us(times_us: np.ndarray, edge_um: np.ndarray, share: float = SHRUNK_SHARE) -> float:
    """Time in us at which a box edge (rows,) first is `share` of its first value; NaN if it never is.

    Linear between the rows around it.
    """
    wanted_um = share * edge_um[0]
    reached = np.flatnonzero(edge_um <= wanted_um)
    if len(reached) == 0:
        return np.nan
    around = slice(reached[0] - 1, reached[0] + 1)
    return float(np.interp(-wanted_um, -edge_um[around], times_us[around]))  # np.interp wants rising abscissae


def power_law(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Exponent b of y = a x^b by least squares of the logarithms (n,), and its standard error.

    Standard error of the slope: sqrt(sum of squared residuals / (n - 2) / sum of squared deviations of log x). Both are
    NaN if all x are equal, the standard error also for n < 3.
    """
    if len(np.unique(x)) < 2:
        return np.nan, np.nan
    log_x, log_y = np.log(x / x[0]), np.log(y / y[0])  # as ratios, so that equal y give 0 without rounding
    log_x, log_y = log_x - log_x.mean(), log_y - log_y.mean()
    squares = log_x @ log_x
    exponent = log_x @ log_y / squares
    residuals = log_y - exponent * log_x
    free = len(residuals) - 2
    return float(exponent), float(np.sqrt(residuals @ residuals / free / squares)) if free > 0 else np.nan


def outside_share(position_um: np.ndarray, lowest_um: np.ndarray, highest_um: np.ndarray) -> float:
    """Share of the coordinates (n, 3) outside the range from `lowest_um` to `highest_um` (3,) of their axis."""
    return float(np.mean((position_um < lowest_um) | (position_um > highest_um)))
