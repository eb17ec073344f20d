"""Fluctuation of composition: how much the local volume fraction of a phase varies between windows of a structure.

The coarseness of a phase is the standard deviation of its local volume fraction, its volume in a cubic window over that
of the window, divided by the mean (Lu & Torquato, J. Chem. Phys. 93, 3452, 1990). Windows of exactly the edge asked for
lie at every place of the periodic box. A grid of whole windows would have to stretch them to fit into the box, and two
boxes that differ by a little could get windows of different number and size.
"""

from collections.abc import Iterator

import numpy as np

from slurrycast.data.frames import Particles
from slurrycast.data.periodic import to_scaled
from slurrycast.dem.recipe import sphere_volume_um3

WINDOWS_UM = (2.0, 4.0)
FEWEST_WINDOWS = 2  # along each edge of the box
_VOXELS_PER_WINDOW = 10
_POINTS_PER_DIAMETER = 8
_POINTS_AT_ONCE = 1_000_000


def ball_points() -> np.ndarray:
    """Points (m, 3) that stand for a ball of radius 1 about the origin: those of a cubic grid inside of it."""
    axis = (np.arange(_POINTS_PER_DIAMETER) + 0.5) * 2 / _POINTS_PER_DIAMETER - 1
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    return points[np.linalg.norm(points, axis=1) < 1]


def _voxels(scaled: np.ndarray, scaled_radius: np.ndarray, shape: np.ndarray) -> Iterator[tuple[slice, np.ndarray]]:
    """Some spheres at a time, and the flat index (spheres, m) of the voxel that each point of them lies in."""
    points = ball_points()
    at_once = max(1, _POINTS_AT_ONCE // len(points))
    for start in range(0, len(scaled), at_once):
        some = slice(start, start + at_once)
        place = scaled[some, None] + points * scaled_radius[some, None]
        index = np.floor(place * shape).astype(np.int64) % shape
        yield some, np.ravel_multi_index(tuple(np.moveaxis(index, -1, 0)), shape)


def coarseness(
    position_um: np.ndarray, lower_um: np.ndarray, edges_um: np.ndarray, particles: Particles, window_um: float
) -> dict[str, float]:
    """Coarseness of each phase in windows of one size.

    Parameters
    ----------
    position_um
        Positions (n, 3) in um, which may be unwrapped.
    lower_um, edges_um
        Lower corner (3,) and edges (3,) of the box in um.
    particles
        The n particles.
    window_um
        Edge of a window in um.

    Returns
    -------
    Standard deviation over mean by the name of each phase that has particles. Empty if an edge of the box, rounded to
    whole windows, is shorter than `FEWEST_WINDOWS` of them, or a particle is wider than a window.

    Notes
    -----
    The volume of a sphere is spread evenly over `ball_points` and counted in voxels of a tenth of a window. With the
    Fourier transform F(k) of the volumes and k = 2 pi f / edge, the variance over all places of the window is the sum
    of |F(k)|^2 prod sinc^2(f window / edge) over all k but 0, as a share of F(0)^2.
    """
    too_wide = 2 * np.max(particles.radius_um) > window_um
    if too_wide or round(float(np.min(edges_um)) / window_um) < FEWEST_WINDOWS:
        return {}
    shape = np.ceil(edges_um * _VOXELS_PER_WINDOW / window_um).astype(int)
    scaled = to_scaled(position_um, lower_um, edges_um)
    share_um3 = sphere_volume_um3(2 * particles.radius_um) / len(ball_points())
    window = [
        np.sinc(np.fft.fftfreq(n, 1 / n) * window_um / edge) ** 2 for n, edge in zip(shape, edges_um, strict=True)
    ]
    window[2] = window[2][: shape[2] // 2 + 1]
    # Only half of the transform of real numbers is kept; the other half says the same again.
    twice = np.full(len(window[2]), 2.0)
    twice[0] = 1
    if shape[2] % 2 == 0:
        twice[-1] = 1
    found = {}
    for phase in particles.phase_names:
        chosen = particles.in_phase(phase)
        if not chosen.any():
            continue
        volume_um3 = np.zeros(np.prod(shape))
        of_phase, weight = particles.radius_um[chosen, None] / edges_um, share_um3[chosen]
        for some, index in _voxels(scaled[chosen], of_phase, shape):
            weights = np.broadcast_to(weight[some, None], index.shape).ravel()
            volume_um3 += np.bincount(index.ravel(), weights, minlength=len(volume_um3))
        power = np.abs(np.fft.rfftn(volume_um3.reshape(shape))) ** 2
        total = power[0, 0, 0]
        power[0, 0, 0] = 0
        found[phase] = float(np.sqrt(np.einsum("ijk,i,j,k->", power, window[0], window[1], window[2] * twice) / total))
    return found
