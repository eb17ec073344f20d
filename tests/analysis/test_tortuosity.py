"""Tortuosity factors: channels, laminates, resistors in series, equations written out, and an independent program."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from slurrycast.analysis.tortuosity import conducting, limit_of_fine_voxels, tortuosity
from slurrycast.runtime.files import InputError

CUBES_UM = np.full(3, 0.1)


def random_void(shape: tuple[int, int, int], share: float, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).random(shape) < share


@pytest.mark.parametrize("spacing_um", [CUBES_UM, np.array([0.1, 0.13, 0.07])])
def test_straight_channels_and_a_laminate_along_the_flow(spacing_um):
    channels = np.broadcast_to(random_void((9, 8, 1), 0.4), (9, 8, 30))
    laminate = np.broadcast_to((np.arange(9) % 3 > 0)[:, None, None], (9, 8, 30))
    for void in (channels, laminate, np.ones((3, 2, 5), dtype=bool)):
        assert tortuosity(void, spacing_um) == pytest.approx(1, abs=1e-6)


def test_isolated_parts_hold_no_flow():
    void = np.zeros((10, 10, 12), dtype=bool)
    void[2:4, 2:4] = True
    share = void.mean()
    void[6:9, 6:9, 3:9] = True
    void[6:9, 6, :3] = True  # a dead end at the lower face
    assert not conducting(void)[5:].any()
    assert tortuosity(void, CUBES_UM) == pytest.approx(void.mean() / share, abs=1e-6)


def test_two_layers_in_series():
    """A layer that is open on both of two columns, below one that is open on the first of them."""
    void = np.ones((2, 1, 2), dtype=bool)
    void[1, 0, 1] = False
    h, height = 0.1, 0.2
    across, along = h * height / h, h * h / height  # conductances between neighbours
    # The second column reaches the first one from both sides, and the faces are half a voxel away.
    lower = 2 * along + 1 / (1 / (2 * along) + 1 / (2 * across))
    flux = 1 / (1 / lower + 1 / along + 1 / (2 * along))
    expected = void.mean() * (2 * h * h / (2 * height)) / flux
    assert tortuosity(void, np.array([h, h, height])) == pytest.approx(expected, abs=1e-6)


def test_a_step_aside_through_the_periodic_sides():
    # A channel that moves from the first to the last column in its middle: a length of wire, but for both bends.
    void = np.zeros((7, 1, 9), dtype=bool)
    void[0, 0, :5] = void[-1, 0, 4:] = True
    steps = 9 + 1  # between centres and to the faces: 9 along and 1 aside
    assert tortuosity(void, CUBES_UM) == pytest.approx(void.mean() * 7 / 9 * steps, abs=1e-6)
    assert np.isnan(tortuosity(np.delete(void, -1, axis=0), CUBES_UM))


def test_no_way_through():
    void = np.ones((5, 5, 6), dtype=bool)
    void[:, :, 3] = False
    assert np.isnan(tortuosity(void, CUBES_UM))
    assert np.isnan(tortuosity(np.zeros((3, 3, 3), dtype=bool), CUBES_UM))


def test_extrapolation_to_voxels_of_no_size():
    spacings_um = np.array([0.3, 0.1, 0.2])
    assert limit_of_fine_voxels(spacings_um, 1.5 + 4 * spacings_um) == pytest.approx(1.5, rel=1e-12)
    # Least squares: the mean of the factors less the slope, 1.5 / 0.2, times the mean of the spacings.
    assert limit_of_fine_voxels([0.1, 0.2, 0.3], [2.0, 2.6, 3.5]) == pytest.approx(2.7 - 7.5 * 0.2, rel=1e-12)
    assert np.isnan(limit_of_fine_voxels([0.1, 0.125, 0.15], [2.485, 2.83, 3.398]))  # would be 0.62
    assert np.isnan(limit_of_fine_voxels(spacings_um, [2.0, np.nan, 2.2]))
    with pytest.raises(InputError, match="of 2 spacings: at least 3 are needed"):
        limit_of_fine_voxels([0.1, 0.2, 0.1], [2.0, 2.6, 2.0])


def test_equations_written_out_voxel_by_voxel():
    void, spacing = random_void((5, 4, 6), 0.6), np.array([0.1, 0.12, 0.09])
    places = [tuple(place) for place in np.argwhere(conducting(void))]
    number = {place: row for row, place in enumerate(places)}
    matrix, inflow = np.zeros((len(places),) * 2), np.zeros(len(places))
    conductance = np.prod(spacing) / spacing**2
    for place, row in number.items():
        for axis in range(3):
            for step in (-1, 1):
                other = list(place)
                other[axis] += step
                if axis == 2 and not 0 <= other[2] < 6:
                    matrix[row, row] += 2 * conductance[2]
                    inflow[row] += 2 * conductance[2] * (step < 0)
                    continue
                other[axis] %= void.shape[axis]
                if tuple(other) in number:
                    matrix[row, row] += conductance[axis]
                    matrix[row, number[tuple(other)]] -= conductance[axis]
    concentration = np.linalg.solve(matrix, inflow)
    flux = np.sum(inflow * (1 - concentration))
    size = spacing * void.shape
    expected = void.mean() * size[0] * size[1] / size[2] / flux
    assert expected > 1.3
    assert tortuosity(void, spacing) == pytest.approx(expected, rel=1e-6)


def test_an_independent_program():
    taufactor = pytest.importorskip("taufactor", reason="needs taufactor and torch, which the project does not")
    # Blurred noise: grains of several voxels, as of a structure.
    field = gaussian_filter(np.random.default_rng(3).normal(size=(30, 30, 40)), 2, mode="wrap")
    void = field < np.quantile(field, 0.45)
    # Its flow is along the first axis, and the sides are periodic.
    solver = taufactor.PeriodicSolver(np.moveaxis(void, 2, 0).astype(np.uint8), device="cpu")
    solver.solve(verbose=False)
    assert tortuosity(void, CUBES_UM) == pytest.approx(float(solver.tau[0]), rel=0.03)
