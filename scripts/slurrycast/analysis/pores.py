"""Pore size as local thickness: the diameter of the largest sphere in the void that holds a place.

Hildebrand & Rüegsegger, J. Microsc. 185, 67 (1997). The image is periodic along all axes.
"""

import numpy as np

_FIRST_MARGIN = 8  # voxels
PERCENTILES = tuple(range(0, 101, 5))  # of the distribution of pore sizes
_POINTS_AT_ONCE = 4_000_000


def distance_to_solid(void: np.ndarray, spacing_um: np.ndarray) -> np.ndarray:
    """Distance (nx, ny, nz) in um from the centre of each void voxel to that of the nearest other one, periodic.

    Infinite if all is void.
    """
    from scipy.ndimage import distance_transform_edt

    if void.all():
        return np.full(void.shape, np.inf)
    margin = _FIRST_MARGIN
    while True:
        padded = np.pad(void, margin, mode="wrap")
        distance_um = distance_transform_edt(padded, sampling=spacing_um)
        distance_um = distance_um[(slice(margin, -margin),) * 3]
        # What lies beyond the margin is farther than this.
        if distance_um.max() <= margin * spacing_um.min():
            return distance_um
        margin *= 2


def local_thickness(void: np.ndarray, spacing_um: np.ndarray) -> np.ndarray:
    """Local thickness of the void.

    Parameters
    ----------
    void
        Mask (nx, ny, nz) of the void.
    spacing_um
        Edges (3,) of a voxel in um.

    Returns
    -------
    Diameters (nx, ny, nz) in um, 0 outside the void, infinite if all is void.

    Notes
    -----
    A sphere about a voxel reaches to the centre of the nearest solid one; half a voxel is taken off its diameter, which
    is the mean error across a slit. What is left is at most half a voxel there, and up to two voxels in round pores.
    """
    distance_um = distance_to_solid(void, spacing_um)
    if void.all() or not void.any():
        return distance_um
    margin = np.ceil(distance_um.max() / spacing_um).astype(int)
    axes = [np.arange(-n, n + 1) for n in margin]
    offsets = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    reach_um = np.linalg.norm(offsets * spacing_um, axis=1)
    order = np.argsort(reach_um, kind="stable")
    offsets, reach_um = offsets[order], reach_um[order]
    # Spheres are drawn from the smallest to the largest one into an image with a margin, which is then folded back.
    shape = np.array(void.shape) + 2 * margin
    steps = np.array([shape[1] * shape[2], shape[2], 1])
    centres = np.argwhere(_not_covered(distance_um, offsets[:27], reach_um[:27]))
    radius_um = distance_um[tuple(centres.T)]
    order = np.argsort(radius_um, kind="stable")
    radius_um, start, flat = radius_um[order], (centres[order] + margin) @ steps, offsets @ steps
    drawn_um = np.zeros(shape.prod(), dtype=np.float32)
    covered = np.searchsorted(reach_um, radius_um * (1 - 1e-9))  # voxels nearer than the radius
    for size in np.unique(covered):
        of_size = np.arange(*np.searchsorted(covered, [size, size + 1]))
        at_once = max(1, _POINTS_AT_ONCE // size)
        for some in np.split(of_size, range(at_once, len(of_size), at_once)):
            drawn_um[(start[some, None] + flat[:size]).ravel()] = np.repeat(radius_um[some], size)
    folded_um = drawn_um.reshape(shape)
    for axis, (n, width) in enumerate(zip(void.shape, margin, strict=True)):
        folded_um = _fold(folded_um, axis, n, width)
    return np.where(void, 2 * folded_um - np.mean(spacing_um) / 2, 0)


def _not_covered(distance_um: np.ndarray, offsets: np.ndarray, reach_um: np.ndarray) -> np.ndarray:
    """Void voxels whose sphere does not lie inside that of a neighbour."""
    chosen = distance_um > 0
    for offset, reach in zip(offsets[1:], reach_um[1:], strict=True):
        chosen &= np.roll(distance_um, tuple(-offset), axis=(0, 1, 2)) < (distance_um + reach) * (1 - 1e-9)
    return chosen


def _fold(image: np.ndarray, axis: int, n: int, width: int) -> np.ndarray:
    """Largest value of each voxel and its images along an axis with `width` more voxels at both ends."""
    image = np.moveaxis(image, axis, 0)
    folded = image[width : width + n].copy()
    for place in (*range(width), *range(width + n, len(image))):
        np.maximum(folded[(place - width) % n], image[place], out=folded[(place - width) % n])
    return np.moveaxis(folded, 0, axis)


def pore_sizes(void: np.ndarray, spacing_um: np.ndarray) -> dict[str, float]:
    """Mean and percentiles, d0 to d100, in um of the `local_thickness` over the volume of the void.

    NaN without void or solid.
    """
    names = ("mean", *(f"d{percent}" for percent in PERCENTILES))
    if void.all() or not void.any():
        return dict.fromkeys(names, float("nan"))
    thickness_um = local_thickness(void, spacing_um)[void]
    sizes_um = [thickness_um.mean(), *np.percentile(thickness_um, PERCENTILES)]
    return dict(zip(names, map(float, sizes_um), strict=True))
