"""Radial distribution functions, with the distance search of MDAnalysis."""

from collections.abc import Iterable

import numpy as np
from MDAnalysis.lib.distances import distance_array

from slurrycast.data.periodic import wrap
from slurrycast.runtime.files import InputError

# Box edges beyond which a sphere would meet its own periodic image, with a margin for the float32 of MDAnalysis.
MAX_SHARE_OF_EDGE = 0.49
# Distances held at a time: bounds the memory to about 200 MB at any number of particles. Computing them all and leaving
# the cut to the histogram is faster than a neighbour search here, where the range spans about half of the box.
DISTANCES_AT_A_TIME = 10_000_000


def bin_edges_um(cutoff_um: float, bins: int, box_edges_um: Iterable[np.ndarray]) -> np.ndarray:
    """Edges of the histogram bins, from 0, valid in each of the boxes that are compared.

    The width is always cutoff / bins. The range ends at min(cutoff, 0.49 x the shortest edge of `box_edges_um`), cut
    to whole bins: minimum-image distances are incomplete beyond half an edge.
    """
    width_um = cutoff_um / bins
    shortest_um = min(float(np.min(edges)) for edges in box_edges_um)
    # The tiny summand keeps all bins when cutoff / width is a rounding error below their number.
    whole_bins = min(bins, int(MAX_SHARE_OF_EDGE * shortest_um / width_um + 1e-9))
    if whole_bins < 1:
        raise InputError(f"box edge {shortest_um:g} um: too short for one RDF bin of {width_um:g} um")
    return width_um * np.arange(whole_bins + 1)


def radial_distribution(
    position_um: np.ndarray,
    lower_um: np.ndarray,
    edges_um: np.ndarray,
    r_edges_um: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
) -> np.ndarray:
    """g(r) of the particles `second` around the particles `first` in the bins `r_edges_um` (bins + 1,), from 0.

    `position_um` (n, 3) may be unwrapped; `first` and `second` are masks (n,) of either the same or of disjoint
    particles. Normalised as `MDAnalysis.analysis.rdf.InterRDF`: counted pairs over those of an ideal gas of the same
    number density; with `first` = `second`, a particle is no neighbour of itself, neither in the count nor in the
    number of pairs, n (n - 1).
    """
    # MDAnalysis computes in float32 and puts its box at the origin.
    position = (wrap(position_um, lower_um, edges_um) - lower_um).astype(np.float32)
    box = np.array([*edges_um, 90, 90, 90], dtype=np.float32)
    around, neighbours = position[first], position[second]
    same = np.array_equal(first, second)
    counts = np.zeros(len(r_edges_um) - 1)
    rows = max(1, DISTANCES_AT_A_TIME // max(1, len(neighbours)))
    for start in range(0, len(around), rows):
        distance_um = distance_array(around[start : start + rows], neighbours, box=box)
        if same:
            np.fill_diagonal(distance_um[:, start:], np.inf)
        counts += np.histogram(distance_um, bins=len(counts), range=(r_edges_um[0], r_edges_um[-1]))[0]
    possible_pairs = len(around) * (len(neighbours) - same)
    shell_um3 = 4 / 3 * np.pi * np.diff(r_edges_um**3)
    return counts / (possible_pairs / np.prod(edges_um) * shell_um3)


def mean_absolute_difference(g_a: np.ndarray, g_b: np.ndarray) -> float:
    """Mean over all bins of |g_a - g_b|."""
    return float(np.mean(np.abs(g_a - g_b)))
