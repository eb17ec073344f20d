"""Coordinates in a periodic, orthogonal box: wrapped, unwrapped, scaled, and the shortest difference of two.

Pure float64 numpy. `position` has shape (n, 3); a box is its `lower` corner (3,) and its `edges` (3,), all in the same
length unit. Scaled coordinates are 0 at the lower corner and 1 at the upper one.
"""

import numpy as np


def to_scaled(position: np.ndarray, lower: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Scaled coordinates (n, 3) of Cartesian ones; an unwrapped position gives values outside [0, 1)."""
    return (position - lower) / edges


def to_cartesian(scaled: np.ndarray, lower: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Cartesian coordinates (n, 3) of scaled ones."""
    return lower + scaled * edges


def wrap(position: np.ndarray, lower: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Periodic image (n, 3) of each position inside the box: lower <= image < lower + edges on every axis.

    What is inside already stays as it is; NaN stays NaN, and infinity becomes it.
    """
    position, lower, edges = (np.asarray(array, dtype=np.float64) for array in (position, lower, edges))
    images = position - edges * np.floor(to_scaled(position, lower, edges))
    # An image within rounding of a face can end on the upper face or just outside: it belongs to the lower face.
    images = np.where(_is_outside(images, lower, edges), lower, images)
    return np.where(_is_outside(position, lower, edges), images, position)


def _is_outside(position: np.ndarray, lower: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return (position < lower) | (position >= lower + edges)


def image_flags(position: np.ndarray, lower: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """How many boxes away from its wrapped image each position is: integers (n, 3), as LAMMPS' ix, iy, iz."""
    return np.rint((position - wrap(position, lower, edges)) / edges).astype(np.int64)


def unwrap(wrapped: np.ndarray, images: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Unwrapped positions (n, 3) from wrapped ones and their image flags (n, 3)."""
    return wrapped + images * edges


def minimum_image(displacement: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Shortest periodic image (n, 3) of each displacement: at most half an edge on every axis."""
    return displacement - edges * np.rint(displacement / edges)
