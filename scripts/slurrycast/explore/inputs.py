"""The inputs that differ between recipes, and how a unit cube covers their ranges.

An input has the name of its column in a table of recipes: mass_fraction_<phase>, size_factor_<phase> and others. Mass
fractions that vary keep their sum, so there is one coordinate less than there are inputs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

SHARE = "mass_fraction_"  # start of the names of inputs whose sum is kept
CONFIRMED = "yes"  # in column `confirm` of a table of recipes: by the full DEM too
_HALVINGS = 60  # of an interval; more change no digit


def _distribution(sums: np.ndarray, widths: np.ndarray) -> np.ndarray:
    """Volume of the box [0, widths] (m,) in which the coordinates' sum is at most each of `sums` (n,), but for 1 / m!.

    By inclusion and exclusion of the corners.
    """
    corners = np.array(list(product((0, 1), repeat=len(widths))))
    beyond = np.maximum(sums[:, None] - corners @ widths, 0)
    return (beyond ** len(widths)) @ (-1.0) ** corners.sum(axis=1)


def bounded_shares(unit: np.ndarray, lower: np.ndarray, upper: np.ndarray, total: float) -> np.ndarray:
    """Shares within bounds and with a given sum, uniform where `unit` is.

    Parameters
    ----------
    unit
        Points (n, k - 1) in the unit cube.
    lower, upper
        Bounds (k,), lower < upper, with sum(lower) < total < sum(upper).
    total
        Sum of the k shares.

    Returns
    -------
    Shares (n, k). Each follows from the one before by the inverse of its distribution, given those before it, so a low
    discrepancy of `unit` is kept.
    """
    widths = upper - lower
    left = np.full(len(unit), total - lower.sum())  # what is to be shared out above the lower bounds
    shares = np.tile(lower, (len(unit), 1))
    for place in range(len(widths) - 1):
        rest = widths[place + 1 :]
        low, high = np.maximum(left - rest.sum(), 0), np.minimum(left, widths[place])
        # the rest has to take what this share leaves: its distribution at left - share falls from `first` to `last`
        first, last = _distribution(left - low, rest), _distribution(left - high, rest)
        wanted = first + unit[:, place] * (last - first)
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            is_low = _distribution(left - middle, rest) > wanted
            low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
        shares[:, place] += low
        left = left - low
    shares[:, -1] += left
    return np.clip(shares, lower, upper)


@dataclass(frozen=True)
class InputSpace:
    """Ranges of the inputs, by name and in order: `lower` and `upper` (inputs,), and the sum of the shares."""

    names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    share_total: float = 1.0

    @classmethod
    def of_ranges(cls, ranges: Mapping[str, Sequence[float]], share_total: float) -> "InputSpace":
        """The space of lowest and highest values by name."""
        lower, upper = np.array(list(ranges.values()), dtype=float).T
        return cls(tuple(ranges), lower, upper, share_total)

    @classmethod
    def of_table(cls, recipes: "pd.DataFrame", inputs: Sequence[str]) -> "InputSpace":
        """The space that a table of recipes spans, of those of its columns `inputs` that vary."""
        varied = [name for name in inputs if recipes[name].nunique() > 1]
        total = float(recipes[[name for name in varied if name.startswith(SHARE)]].sum(axis=1).mean())
        return cls(tuple(varied), recipes[varied].min().to_numpy(), recipes[varied].max().to_numpy(), total)

    @property
    def shares(self) -> np.ndarray:
        """Mask (inputs,) of the mass fractions."""
        return np.array([name.startswith(SHARE) for name in self.names])

    @property
    def coordinates(self) -> list[str]:
        """Names of the inputs that are free: all but the last mass fraction, which is what the others leave."""
        last = max(np.flatnonzero(self.shares), default=None)
        return [name for place, name in enumerate(self.names) if place != last]

    def at(self, unit: np.ndarray) -> np.ndarray:
        """Inputs (n, inputs) of points (n, coordinates) in the unit cube."""
        is_share = np.array([name.startswith(SHARE) for name in self.coordinates])
        found = np.empty((len(unit), len(self.names)))
        found[:, ~self.shares] = self.lower[~self.shares] + unit[:, ~is_share] * (self.upper - self.lower)[~self.shares]
        if is_share.any():
            bounds = self.lower[self.shares], self.upper[self.shares]
            found[:, self.shares] = bounded_shares(unit[:, is_share], *bounds, self.share_total)
        return found

    def scaled(self, inputs: np.ndarray) -> np.ndarray:
        """Coordinates (n, coordinates) of inputs (n, inputs), each as a share of its range."""
        free = [self.names.index(name) for name in self.coordinates]
        return ((inputs - self.lower) / (self.upper - self.lower))[:, free]

    def centre(self) -> np.ndarray:
        """Inputs (inputs,) of the centre of the unit cube: medians, of a mass fraction given those before it."""
        return self.at(np.full((1, len(self.coordinates)), 0.5))[0]


def sobol_points(count: int, dimensions: int, seed: int) -> np.ndarray:
    """The first `count` points (count, dimensions) of a scrambled Sobol sequence; more begin with the same ones."""
    from scipy.stats import qmc

    power = max(count - 1, 0).bit_length()  # whole powers of two are balanced
    return qmc.Sobol(dimensions, scramble=True, rng=np.random.default_rng(seed)).random_base2(power)[:count]
