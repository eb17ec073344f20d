"""Voxel images of spheres in a periodic box."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from slurrycast.data.periodic import to_scaled
from slurrycast.runtime.files import InputError, hdf5_moved_into_place

VOID = 0
_POINTS_AT_ONCE = 1_000_000
_MAX_CODE = np.iinfo(np.uint8).max
MOST_VOXELS = 50_000_000  # pore sizes take some 100 bytes for each


def voxel_shape(edges_um: np.ndarray, spacing_um: float) -> tuple[int, int, int]:
    """Numbers of voxels whose edges come nearest to a spacing in um, so that whole voxels fill a box (3,).

    InputError if they are more than `MOST_VOXELS`.
    """
    shape = tuple(int(n) for n in np.maximum(1, np.rint(edges_um / spacing_um)))
    if math.prod(shape) > MOST_VOXELS:
        raise InputError(
            f"voxels of {spacing_um:g} um: {math.prod(shape)} in the box, at most {MOST_VOXELS} are allowed"
        )
    return shape


def voxel_image(
    position_um: np.ndarray,
    lower_um: np.ndarray,
    edges_um: np.ndarray,
    radius_um: np.ndarray,
    code: np.ndarray,
    spacing_um: float,
) -> np.ndarray:
    """Image of spheres: each voxel has the code of the sphere that its centre lies in, or `VOID`.

    Parameters
    ----------
    position_um
        Centres (n, 3) in um, which may be unwrapped.
    lower_um, edges_um
        Lower corner (3,) and edges (3,) of the box in um.
    radius_um
        Radii (n,) in um.
    code
        Number (n,) from 1 to 255 of each sphere, such as its phase.
    spacing_um
        Edge of a voxel; the edges of the voxels are `edges_um / image.shape`, see `voxel_shape`.

    Returns
    -------
    Codes (nx, ny, nz), uint8. Where spheres overlap, a voxel belongs to the one whose surface reaches furthest beyond
    it, that of the least distance to the centre less the radius.

    Raises
    ------
    InputError
        If a code is not between 1 and 255, or there are too many voxels (`voxel_shape`).
    """
    if len(code) and not 1 <= np.min(code) <= np.max(code) <= _MAX_CODE:
        raise InputError(f"voxel codes {np.min(code)} to {np.max(code)}: must be 1 to {_MAX_CODE}")
    shape = np.array(voxel_shape(edges_um, spacing_um))
    h_um = edges_um / shape
    place = to_scaled(position_um, lower_um, edges_um) * shape - 0.5  # in voxels, whole at their centres
    nearest = np.rint(place).astype(np.int64)
    image = np.zeros(shape.prod(), dtype=np.uint8)
    height_um = np.zeros(shape.prod(), dtype=np.float32)  # of a centre over the surface, negative inside
    for radius in np.unique(radius_um):
        of_size = np.flatnonzero(radius_um == radius)
        stencil = _stencil(radius, h_um)
        at_once = max(1, _POINTS_AT_ONCE // len(stencil))
        for start in range(0, len(of_size), at_once):
            some = of_size[start : start + at_once]
            voxel = nearest[some, None] + stencil
            height = np.linalg.norm((voxel - place[some, None]) * h_um, axis=-1).ravel() - radius
            index = np.ravel_multi_index(tuple(np.moveaxis(voxel % shape, -1, 0)), shape).ravel()
            codes = np.repeat(code[some], len(stencil))
            lower = np.flatnonzero((height < 0) & (height < height_um[index]))
            # Of several values for one voxel numpy keeps the last one.
            lower = lower[np.argsort(-height[lower], kind="stable")]
            height_um[index[lower]] = height[lower]
            image[index[lower]] = codes[lower]
    return image.reshape(shape)


def _stencil(radius_um: float, h_um: np.ndarray) -> np.ndarray:
    """Offsets (m, 3) of all voxels whose centres may lie in a sphere about a point of the voxel at the origin."""
    axes = [np.arange(-n, n + 1) for n in np.ceil(radius_um / h_um).astype(int)]
    offsets = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return offsets[np.linalg.norm(offsets * h_um, axis=1) < radius_um + np.linalg.norm(h_um) / 2]


def phase_shares(image: np.ndarray, phases: int) -> np.ndarray:
    """Share (phases + 1, nz) of each code, from `VOID`, in each layer of voxels along z."""
    return np.stack([np.mean(image == code, axis=(0, 1)) for code in range(phases + 1)])


def write_voxels(path: str | Path, image: np.ndarray, edges_um: np.ndarray, phase_names: Sequence[str]) -> None:
    """Write an image (nx, ny, nz) as data set `phase` of an HDF5 file, compressed.

    Its attributes are `spacing_um` and `element_size_um`, as image viewers call it, both the edges (3,) of a voxel in
    the order of the axes, `axes` (x, y, z) and `codes`: the names of the codes from 0, `void` and then the phases.
    """
    with hdf5_moved_into_place(path) as file:
        data = file.create_dataset("phase", data=image, compression="gzip", shuffle=True, fletcher32=True)
        spacing_um = edges_um / image.shape
        data.attrs.update({"spacing_um": spacing_um, "element_size_um": spacing_um, "axes": ["x", "y", "z"]})
        data.attrs["codes"] = ["void", *phase_names]
