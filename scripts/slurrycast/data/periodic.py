"""Coordinates in a periodic, orthogonal box: scaled, wrapped, and the shortest difference of two.

Pure float64 numpy. `position` has shape (n, 3); a box is its `lower` corner (3,) and its `edges` (3,), all in the same
length unit. Scaled coordinates are 0 at the lower corner and 1 at the upper one.
"""

import numpy as np


def to_scaled(position: np.ndarray, lower: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Scaled coordinates (n, 3) of Cartesian ones; an unwrapped position gives values outside [0, 1)."""
    return (position - lower) / edges


def wrap(position: np.ndarray, lower: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Periodic images of positions inside the box.

    Parameters
    ----------
    position
        Positions (n, 3).
    lower, edges
        Lower corner (3,) and edges (3,) of the box, in the same unit.

    Returns
    -------
    Images (n, 3) with lower <= image < lower + edges on every axis. A position inside the box stays as it is; NaN stays
    NaN, and infinity becomes NaN.
    """
    position, lower, edges = (np.asarray(array, dtype=np.float64) for array in (position, lower, edges))
    images = position - edges * np.floor(to_scaled(position, lower, edges))
    # An image within rounding of a face can end on the upper face or just outside: it belongs to the lower face.
    images = np.where(_is_outside(images, lower, edges), lower, images)
    return np.where(_is_outside(position, lower, edges), images, position)


def _is_outside(position: np.ndarray, lower: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return (position < lower) | (position >= lower + edges)


def minimum_image(displacement: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Shortest periodic image (n, 3) of each displacement: at most half an edge on every axis."""
    return displacement - edges * np.rint(displacement / edges)
