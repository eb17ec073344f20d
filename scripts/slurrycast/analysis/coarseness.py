"""Fluctuation of composition: how much the local volume fraction of a phase varies between windows of a structure.

The coarseness of a phase is the standard deviation of its local volume fraction, its volume in a cubic window over that
of the window, divided by the mean (Lu & Torquato, J. Chem. Phys. 93, 3452, 1990). Windows of exactly the edge asked for
lie at every place of the periodic box. A grid of whole windows would have to stretch them to fit into the box, and two
boxes that differ by a little could get windows of different number and size.

The volume of a sphere is spread evenly over `ball_points` and counted in voxels of a tenth of a window. With the
Fourier transform F(k) of the volumes and k = 2 pi f / edge, the variance over all places of the window is the sum
of |F(k)|^2 prod sinc^2(f window / edge) over all k but 0, over the square of the box's volume.
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


def windows_fit(edges_um: np.ndarray, radius_um: np.ndarray, window_um: float) -> bool:
    """Whether windows are as wide as the widest of spheres (n,), and `FEWEST_WINDOWS` fit along each edge (3,)."""
    wide_enough = bool(2 * np.max(radius_um) <= window_um)
    return wide_enough and round(float(np.min(edges_um)) / window_um) >= FEWEST_WINDOWS


def window_deviation(
    position_um: np.ndarray,
    lower_um: np.ndarray,
    edges_um: np.ndarray,
    radius_um: np.ndarray,
    volume_um3: np.ndarray,
    window_um: float,
) -> float:
    """Standard deviation, over all places of a window, of the share of it that volumes spread over spheres take.

    Parameters
    ----------
    position_um, radius_um
        Centres (n, 3), which may be unwrapped, and radii (n,) in um of at least one sphere.
    lower_um, edges_um
        Lower corner (3,) and edges (3,) of the box in um.
    volume_um3
        What is spread over each sphere (n,), such as its volume, which may be weighted, also by a negative number.
    window_um
        Edge of a window in um, which fits (`windows_fit`).
    """
    shape = np.ceil(edges_um * _VOXELS_PER_WINDOW / window_um).astype(int)
    scaled = to_scaled(position_um, lower_um, edges_um)
    share_um3 = volume_um3 / len(ball_points())
    window = [
        np.sinc(np.fft.fftfreq(n, 1 / n) * window_um / edge) ** 2 for n, edge in zip(shape, edges_um, strict=True)
    ]
    window[2] = window[2][: shape[2] // 2 + 1]
    # Only half of the transform of real numbers is kept; the other half says the same again.
    twice = np.full(len(window[2]), 2.0)
    twice[0] = 1
    if shape[2] % 2 == 0:
        twice[-1] = 1
    spread_um3 = np.zeros(np.prod(shape))
    for some, index in _voxels(scaled, radius_um[:, None] / edges_um, shape):
        weights = np.broadcast_to(share_um3[some, None], index.shape).ravel()
        spread_um3 += np.bincount(index.ravel(), weights, minlength=len(spread_um3))
    power = np.abs(np.fft.rfftn(spread_um3.reshape(shape))) ** 2
    power[0, 0, 0] = 0
    variance_um6 = np.einsum("ijk,i,j,k->", power, window[0], window[1], window[2] * twice)
    return float(np.sqrt(variance_um6) / np.prod(edges_um))


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
    """
    if not windows_fit(edges_um, particles.radius_um, window_um):
        return {}
    volume_um3 = sphere_volume_um3(2 * particles.radius_um)
    found = {}
    for phase in particles.phase_names:
        chosen = particles.in_phase(phase)
        if chosen.any():
            of_phase = position_um[chosen], lower_um, edges_um, particles.radius_um[chosen], volume_um3[chosen]
            mean = volume_um3[chosen].sum() / np.prod(edges_um)
            found[phase] = float(window_deviation(*of_phase, window_um) / mean)
    return found


def single_sphere_variance(radius_um: np.ndarray, edges_um: np.ndarray, window_um: float) -> np.ndarray:
    """Variance (n,), over all places of a window, of the share of it that one sphere takes.

    Parameters
    ----------
    radius_um
        Radii (n,) in um of spheres no wider than a window.
    edges_um
        Edges (3,) of the box in um.
    window_um
        Edge of a window in um.

    Notes
    -----
    Two points that differ by d lie in the same window with the probability prod (w - |d_j|) / V. For two random
    points of a ball of radius R the means of |d_x|, |d_x d_y| and |d_x d_y d_z| are 18 R / 35, 4 R^2 / (5 pi) and
    8 R^3 / (21 pi), so with v the volume of the sphere and x = R / w

        variance = v^2 (1 - 54 x / 35 + 12 x^2 / (5 pi) - 8 x^3 / (21 pi)) / (V w^3) - (v / V)^2
    """
    x, volume_um3, box_um3 = radius_um / window_um, sphere_volume_um3(2 * radius_um), np.prod(edges_um)
    together = 1 - 54 * x / 35 + 12 * x**2 / (5 * np.pi) - 8 * x**3 / (21 * np.pi)
    return volume_um3**2 * (together / (box_um3 * window_um**3) - 1 / box_um3**2)


def mixing_deviations(
    position_um: np.ndarray,
    lower_um: np.ndarray,
    edges_um: np.ndarray,
    radius_um: np.ndarray,
    chosen: np.ndarray,
    window_um: float,
) -> tuple[float, float]:
    """Standard deviation over windows of the share of some spheres in the volume of all, and that of a random mixture.

    Parameters
    ----------
    position_um, radius_um
        Centres (n, 3), which may be unwrapped, and radii (n,) of all spheres in um.
    lower_um, edges_um
        Lower corner (3,) and edges (3,) of the box in um.
    chosen
        Mask (n,) of the spheres whose share it is.
    window_um
        Edge of a window in um, which fits (`windows_fit`).

    Notes
    -----
    With P the share of the chosen spheres in all of the box, the share in a window differs from P by the sum of
    (a_i - P) times the volume of sphere i in it, with a_i = 1 for a chosen sphere and else 0, over the volume of all
    spheres in it, for which that in a mean window is taken. In a random mixture, where the place of a sphere says
    nothing of its kind, these terms are independent of each other, and their variances add up, as in the sampling of
    powders (Stange, Chem. Ing. Tech. 26, 331, 1954). Here the window cuts spheres (`single_sphere_variance`).
    """
    volume_um3 = sphere_volume_um3(2 * radius_um)
    filled = volume_um3.sum() / np.prod(edges_um)
    excess = chosen - volume_um3[chosen].sum() / volume_um3.sum()
    deviation = window_deviation(position_um, lower_um, edges_um, radius_um, excess * volume_um3, window_um)
    random = np.sqrt(np.sum(excess**2 * single_sphere_variance(radius_um, edges_um, window_um)))
    return deviation / float(filled), float(random / filled)
