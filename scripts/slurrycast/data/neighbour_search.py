"""Search for neighbouring particles in a periodic box, by freud on one thread.

freud computes in float32 in a box about the origin. Pairs are therefore searched a little further than asked for, and
the caller decides in float64 which of them count. A network imports this module: an edit repeats its training.
"""

from typing import TYPE_CHECKING

import numpy as np

from slurrycast.data.periodic import minimum_image, wrap
from slurrycast.runtime.files import InputError
from slurrycast.runtime.light_imports import without_matplotlib

if TYPE_CHECKING:
    import freud

# Share by which pairs are searched further than asked for: far above the rounding of float32.
SEARCH_MARGIN = 1e-3


def freud_box(
    position_um: np.ndarray, lower_um: np.ndarray, edges_um: np.ndarray
) -> tuple["freud.box.Box", np.ndarray]:
    """Box of freud, and wrapped positions (n, 3) about its centre as float32."""
    with without_matplotlib():
        import freud

    centred_um = wrap(position_um, lower_um, edges_um) - (lower_um + edges_um / 2)
    return freud.box.Box(*edges_um), centred_um.astype(np.float32)


def candidate_pairs(
    position_um: np.ndarray,
    lower_um: np.ndarray,
    edges_um: np.ndarray,
    reach_um: float,
    receivers: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Indices of all pairs within a reach and some that are slightly farther, for the caller to decide in float64.

    Parameters
    ----------
    position_um
        Positions (n, 3), which may be unwrapped.
    lower_um, edges_um
        Lower corner (3,) and edges (3,) of the box.
    reach_um
        Largest distance. The caller checks that it is at most half the shortest edge, where freud ends its search.
    receivers
        Indices (k,) of the particles whose pairs are searched; all if not given.

    Returns
    -------
    tuple
        First and second particle of each pair, (m,) each, the first one of the receivers. No particle is there with
        itself, and every pair of two receivers in both orders.
    """
    box, points = freud_box(position_um, lower_um, edges_um)
    import freud

    below_half = np.nextafter(np.float32(np.min(edges_um)) / np.float32(2), np.float32(0))
    r_max = min((1 + SEARCH_MARGIN) * reach_um, float(below_half))
    with freud.parallel.NumThreads(1):
        if receivers is None:
            query = freud.locality.AABBQuery(box, points).query(points, {"r_max": r_max, "exclude_ii": True})
        else:
            query = freud.locality.AABBQuery(box, points).query(points[receivers], {"r_max": r_max})
        first, second = np.asarray(query.toNeighborList()[:], dtype=np.intp).T
    if receivers is not None:
        first = receivers[first]
        first, second = first[first != second], second[first != second]
    return first, second


def neighbour_pairs(
    position_um: np.ndarray, edges_um: np.ndarray, cutoff_um: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All ordered pairs of different particles within a cutoff, decided in float64.

    Parameters
    ----------
    position_um
        Positions (n, 3), which may be unwrapped.
    edges_um
        Edges (3,) of the box.
    cutoff_um
        Largest distance.

    Returns
    -------
    tuple
        Receivers (m,), senders (m,) and separations (m, 3) from receiver to sender in um, sorted by the first two.

    Raises
    ------
    InputError
        If the cutoff is above half the shortest edge, where a particle has two images of another within reach.
    """
    if cutoff_um > edges_um.min() / 2:
        raise InputError(
            f"cutoff of {cutoff_um:g} um: must be at most half the shortest edge, {edges_um.min() / 2:.4g}"
        )
    inside_um = np.mod(position_um, edges_um)
    inside_um[inside_um >= edges_um] = 0.0  # a rounded -1e-17
    receivers, senders = candidate_pairs(inside_um, np.zeros(3), edges_um, cutoff_um)
    order = np.lexsort((senders, receivers))
    receivers, senders = receivers[order], senders[order]
    separation_um = minimum_image(inside_um[senders] - inside_um[receivers], edges_um)
    near = np.sum(separation_um**2, axis=1) <= cutoff_um**2
    return receivers[near], senders[near], separation_um[near]
