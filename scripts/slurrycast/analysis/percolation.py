"""Percolation of particles in a periodic box: which of them belong to a cluster without an end along an axis.

A cluster of touching particles is infinite along an axis if one of its closed paths crosses the boundaries of the box
along that axis more often one way than the other (its winding number is not 0), however often it winds and through
whichever other faces. The winding numbers of all closed paths follow from those that each contact outside of a spanning
forest closes, so the answer is exact and needs no grid.
"""

import numpy as np

from slurrycast.analysis.structure import Contacts


def _offsets(count: int, first: np.ndarray, second: np.ndarray, image: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Image (count, 3) of each particle as seen from the first of its cluster, along a spanning forest."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order

    # One search through all clusters: from a root that is linked to a particle of each of them.
    root, seeds = count, np.unique(label, return_index=True)[1]
    tail = np.concatenate([first, second, np.full(len(seeds), root)])
    head = np.concatenate([second, first, seeds])
    crossed = np.concatenate([image, -image, np.zeros((len(seeds), 3), dtype=image.dtype)])
    number = csr_array((np.arange(1, len(tail) + 1), (tail, head)), shape=(root + 1, root + 1))
    parent = breadth_first_order(number, root)[1]
    parent[root] = root
    offset = np.zeros((root + 1, 3), dtype=image.dtype)
    offset[:root] = crossed[number[parent[:root], np.arange(root)] - 1]
    # Each round doubles the length of the paths towards the root that the sums hold.
    while (parent != root).any():
        offset += offset[parent]
        parent = parent[parent]
    return offset[:root]


def percolating_shares(
    position_um: np.ndarray, edges_um: np.ndarray, contacts: Contacts, chosen: np.ndarray
) -> np.ndarray:
    """Share of some particles that belong to a cluster of them that is infinite along an axis.

    Parameters
    ----------
    position_um
        Positions (n, 3) in um, which may be unwrapped.
    edges_um
        Edges (3,) of the box in um.
    contacts
        Contacts of all n particles (`find_contacts`), each pair once.
    chosen
        Mask (n,) of the particles that count; contacts with others connect nothing.

    Returns
    -------
    Shares (3,) of the chosen particles for the axes x, y and z; NaN if none is chosen.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = int(chosen.sum())
    if count == 0:
        return np.full(3, np.nan)
    inside = chosen[contacts.first] & chosen[contacts.second]
    place = np.cumsum(chosen) - 1
    first, second = place[contacts.first[inside]], place[contacts.second[inside]]
    scaled = position_um[chosen] / edges_um
    # Added to the second particle's position this gives the image that the first one touches.
    image = -np.rint(scaled[second] - scaled[first]).astype(np.int64)
    links = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    clusters, label = connected_components(links, directed=False)
    offset = _offsets(count, first, second, image, label)
    winding = offset[first] + image - offset[second]
    infinite = np.zeros((clusters, 3), dtype=bool)
    np.logical_or.at(infinite, label[first], winding != 0)
    return infinite[label].mean(axis=0)
