"""The one fit of a power law: how a time or a cost grows with the number of particles. Pure numpy."""

import numpy as np


def power_law(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Exponent b of y = a x^b by least squares of the logarithms, and its standard error.

    Parameters
    ----------
    x, y
        Values (n,) above 0.

    Returns
    -------
    Exponent and standard error; both NaN if all x are equal, the standard error also for n < 3.

    Notes
    -----
    The standard error is that of the slope of a regression line:
    sqrt(sum of squared residuals / (n - 2) / sum of squared deviations of log x).
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
