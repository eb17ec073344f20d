"""Radial distribution functions of all particles and of every pair of phases, counted by freud on one thread.

freud computes in float32 in a box about the origin: a curve feels that only where a distance lies within about 1e-6 um
of a bin's edge.
"""

from collections.abc import Iterable
from itertools import combinations_with_replacement

import numpy as np

from slurrycast.data.frames import Particles
from slurrycast.data.neighbour_search import freud_box
from slurrycast.runtime.files import InputError

# Box edges beyond which a sphere would meet its own periodic image, with a margin for the float32 of freud.
MAX_SHARE_OF_EDGE = 0.49


def phase_pairs(particles: Particles) -> dict[str, tuple[str, str]]:
    """Every unordered pair of phases by its name, `A-A` and `A-B` in the order of the phases.

    Pairs that not even two particles form are left out.
    """
    numbers = {name: int(particles.in_phase(name).sum()) for name in particles.phase_names}
    return {
        f"{a}-{b}": (a, b)
        for a, b in combinations_with_replacement(particles.phase_names, 2)
        if numbers[a] * (numbers[b] - (a == b)) > 0
    }


def bin_edges_um(cutoff_um: float, bins: int, box_edges_um: Iterable[np.ndarray]) -> np.ndarray:
    """Edges of histogram bins that are valid in each of several boxes.

    Parameters
    ----------
    cutoff_um, bins
        Longest distance wanted, in um, and the number of bins up to it. The width of a bin is always cutoff / bins.
    box_edges_um
        Edges (3,) of each box in um. The range ends at min(cutoff, 0.49 x the shortest of them), cut to whole bins,
        because minimum-image distances are incomplete beyond half an edge.

    Returns
    -------
    Edges of the bins in um, from 0, shape (whole bins + 1,).

    Raises
    ------
    InputError
        If the shortest edge has no room for one bin.
    """
    width_um = cutoff_um / bins
    shortest_um = min(float(np.min(edges)) for edges in box_edges_um)
    # The tiny summand keeps all bins when cutoff / width is a rounding error below their number.
    whole_bins = min(bins, int(MAX_SHARE_OF_EDGE * shortest_um / width_um + 1e-9))
    if whole_bins < 1:
        raise InputError(f"box edge {shortest_um:g} um: too short for one RDF bin of {width_um:g} um")
    return width_um * np.arange(whole_bins + 1)


def bin_centres_um(r_edges_um: np.ndarray) -> np.ndarray:
    """Centres (bins,) of bins with the edges (bins + 1,)."""
    return (r_edges_um[:-1] + r_edges_um[1:]) / 2


def radial_distributions(
    position_um: np.ndarray, lower_um: np.ndarray, edges_um: np.ndarray, particles: Particles, r_edges_um: np.ndarray
) -> dict[str, np.ndarray]:
    """Radial distribution functions g(r) of one structure.

    Parameters
    ----------
    position_um
        Positions (n, 3) in um, which may be unwrapped.
    lower_um, edges_um
        Lower corner (3,) and edges (3,) of the box in um.
    particles
        The n particles, for their phases.
    r_edges_um
        Edges (bins + 1,) in um of equal bins from 0, ending below half the shortest edge (`bin_edges_um`).

    Returns
    -------
    g (bins,) of all particles (`all`) and of every pair in `phase_pairs`, by name.

    Notes
    -----
    Normalised as `MDAnalysis.analysis.rdf.InterRDF`: counted pairs over those of an ideal gas of the same number
    density. A particle is no neighbour of itself, neither in the count nor in the number of pairs, n (n - 1). The
    counts of all particles are the sum over the pairs of phases.
    """
    box, points = freud_box(position_um, lower_um, edges_um)
    import freud  # here, since most importers want no RDF

    # Of the volume of the box, in each shell: what an ideal gas has of all possible pairs.
    share_of_box = 4 / 3 * np.pi * np.diff(r_edges_um**3) / np.prod(edges_um)
    r_max_um = float(r_edges_um[-1])
    curves = {}
    all_counts = np.zeros(len(r_edges_um) - 1)
    with freud.parallel.NumThreads(1):
        for pair, (a, b) in phase_pairs(particles).items():
            same = a == b
            around, neighbours = points[particles.in_phase(a)], points[particles.in_phase(b)]
            rdf = freud.density.RDF(bins=len(all_counts), r_max=r_max_um)
            rdf.compute((box, neighbours), around, neighbors={"r_max": r_max_um, "exclude_ii": same})
            counts = rdf.bin_counts.astype(np.float64)
            curves[pair] = counts / (len(around) * (len(neighbours) - same) * share_of_box)
            all_counts += counts if same else 2 * counts
    return {"all": all_counts / (len(points) * (len(points) - 1) * share_of_box)} | curves


def mean_absolute_difference(g_a: np.ndarray, g_b: np.ndarray) -> float:
    """Mean over all bins (bins,) of |g_a - g_b|."""
    return float(np.mean(np.abs(g_a - g_b)))
