"""How much of a property's variance each input causes: Sobol indices."""

from collections.abc import Callable

import numpy as np

SAMPLES = 2**11  # for each input; indices are exact to about 0.01


def sobol_indices(
    function: Callable[[np.ndarray], np.ndarray], dimensions: int, seed: int, samples: int = SAMPLES
) -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices of a function on the unit cube.

    Parameters
    ----------
    function
        Values (n,) at points (n, dimensions).
    dimensions
        Number of inputs, which are independent and uniform.
    seed, samples
        Of the points; a power of two.

    Returns
    -------
    First order (dimensions,), the share of the variance that an input causes alone, and total (dimensions,), with all
    that it causes together with others; NaN where the function is constant.
    """
    from scipy import stats

    if np.ptp(function(np.random.default_rng(seed).random((samples, dimensions)))) == 0:
        return np.full(dimensions, np.nan), np.full(dimensions, np.nan)
    if dimensions == 1:  # which scipy does not take
        return np.ones(1), np.ones(1)
    indices = stats.sobol_indices(
        func=lambda points: function(points.T)[None],
        n=samples,
        dists=[stats.uniform()] * dimensions,
        rng=np.random.default_rng(seed),
    )
    return np.ravel(indices.first_order), np.ravel(indices.total_order)
