"""A Gaussian process of one property over the inputs, its errors at points left out, and intervals that hold there."""

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from sklearn.gaussian_process import GaussianProcessRegressor

LEVEL = 0.9  # of all intervals
# Of the kernel, for inputs from 0 to 1 and a property with sd 1. Lengths far above 1 stand for inputs without effect.
LENGTHS, VARIANCES, NOISES = (0.1, 100.0), (1e-2, 1e3), (1e-6, 1e1)
RESTARTS = 3


def normal_quantile(level: float = LEVEL) -> float:
    """How many sd an interval of this level reaches to either side."""
    from scipy.stats import norm

    return float(norm.ppf((1 + level) / 2))


@dataclass(frozen=True)
class Regression:
    """A fitted property; `process` is one of its values less `centre` over `scale`.

    `left_out` and `left_out_sd` (n,) are what is expected at each point of the fit from all the others. `sd_factor`
    makes intervals as wide as errors there.
    """

    process: "GaussianProcessRegressor"
    centre: float
    scale: float
    left_out: np.ndarray
    left_out_sd: np.ndarray
    sd_factor: float

    def mean(self, inputs: np.ndarray) -> np.ndarray:
        """Expected value (n,) at inputs (n, d)."""
        return self.centre + self.scale * self.process.predict(inputs)

    def interval(self, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Expected value (n,) at inputs (n, d), and half width (n,) of the interval of one more slurry."""
        mean, sd = self.process.predict(inputs, return_std=True)
        return self.centre + self.scale * mean, self.sd_factor * normal_quantile() * self.scale * sd


def fit(inputs: np.ndarray, values: np.ndarray, judged: np.ndarray, seed: int) -> Regression:
    """Fit a Gaussian process with a length for each input, and noise.

    Parameters
    ----------
    inputs
        Points (n, d), 0 to 1.
    values
        The property (n,) there.
    judged
        Mask (n,) of the points whose left out errors the intervals are calibrated on: those that stand alone, since a
        repeated one is easy.
    seed
        Of the starts of the search for the lengths.

    Notes
    -----
    What a point's value would be from all the others follows from the inverse of their covariance (Rasmussen &
    Williams, Gaussian Processes for Machine Learning, section 5.4.2), with lengths and noise as found with it.
    `sd_factor` is the root mean square of (value - left out) / sd, but at least 1: lengths that were found with a point
    make its error small.
    """
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    centre, scale = values.mean(), values.std() or 1.0
    scaled = (values - centre) / scale
    shape = Matern(np.ones(inputs.shape[1]), LENGTHS, nu=2.5)
    kernel = ConstantKernel(1.0, VARIANCES) * shape + WhiteKernel(0.1, NOISES)
    process = GaussianProcessRegressor(kernel, alpha=1e-10, n_restarts_optimizer=RESTARTS, random_state=seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # lengths at their bounds say that an input has no effect
        process.fit(inputs, scaled)
    inverse = np.linalg.inv(process.kernel_(inputs))
    left_out_sd = 1 / np.sqrt(np.diag(inverse))
    left_out = scaled - (inverse @ scaled) * left_out_sd**2
    sd_factor = max(1.0, float(np.sqrt(np.mean(((scaled - left_out) / left_out_sd)[judged] ** 2))))

    return Regression(process, centre, scale, centre + scale * left_out, scale * left_out_sd, sd_factor)


def coverage(values: np.ndarray, left_out: np.ndarray, sd: np.ndarray) -> tuple[float, float]:
    """Share of the values within the interval of `LEVEL` about what follows from the others.

    Parameters
    ----------
    values, left_out, sd
        Values (n,), and what they are expected to be.

    Returns
    -------
    With the sd as it is, and with the one that is calibrated on the other points.
    """
    scores = np.abs(values - left_out) / sd
    others = np.maximum(1.0, np.sqrt((np.sum(scores**2) - scores**2) / (len(scores) - 1)))
    reach = normal_quantile()
    return float(np.mean(scores <= reach)), float(np.mean(scores <= reach * others))


def pooled_sd(values: np.ndarray, groups: np.ndarray) -> tuple[float, int]:
    """Sd of repetitions, and its degrees of freedom; NaN and 0 without any.

    Parameters
    ----------
    values, groups
        Values (n,), and a label (n,) that repetitions share.
    """
    freedom = len(values) - len(np.unique(groups))
    if freedom == 0:
        return np.nan, 0
    squares = sum(np.sum((values[groups == g] - values[groups == g].mean()) ** 2) for g in np.unique(groups))
    return float(np.sqrt(squares / freedom)), freedom
