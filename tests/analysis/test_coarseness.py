"""Fluctuation of composition: random, layered and even structures, whose values are known."""

import numpy as np
import pytest

from slurrycast.analysis.coarseness import (
    ball_points,
    coarseness,
    mixing_deviations,
    single_sphere_variance,
    window_deviation,
)
from slurrycast.dem.recipe import sphere_volume_um3
from structures import particles

NAMES = ("A", "B", "C")


def lattice(edges_um: tuple[float, float, float], spacing_um: float) -> np.ndarray:
    """Sites (n, 3) of a simple cubic lattice that fills a box from 0."""
    axes = [spacing_um * (np.arange(round(edge / spacing_um)) + 0.5) for edge in edges_um]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def test_points_that_stand_for_a_ball():
    points = ball_points()
    assert len(points) > 200
    np.testing.assert_allclose(points.mean(axis=0), 0, atol=1e-12)
    # mean square distance from the centre: 3/5 of the radius
    assert np.mean(np.sum(points**2, axis=1)) == pytest.approx(0.6, rel=0.05)


@pytest.mark.parametrize("window_um", [2.0, 4.0])
def test_layers(window_um):
    """A in one half of the height and B in the other: ramps as wide as a window between full and empty."""
    edges_um = (6.0, 8.0, 16.0)
    position_um = lattice(edges_um, 0.25)
    images = np.random.default_rng(1).integers(-2, 3, position_um.shape) * np.array(edges_um)
    some = particles(np.where(position_um[:, 2] < 8, 1, 2), 0.12, NAMES)
    found = coarseness(position_um + images, np.zeros(3), np.array(edges_um), some, window_um)
    expected = pytest.approx(np.sqrt(1 - 4 * window_um / (3 * 16)), rel=0.01)
    assert found == {"A": expected, "B": expected}


def test_an_even_structure_has_none():
    edges_um = (8.0, 8.0, 12.0)
    position_um = lattice(edges_um, 0.5)
    site = np.round(position_um / 0.5 - 0.5).astype(int)
    some = particles(1 + site.sum(axis=1) % 2, 0.25, NAMES)
    for window_um in (2.0, 4.0):
        assert coarseness(position_um, np.zeros(3), np.array(edges_um), some, window_um)["A"] < 1e-3


@pytest.mark.parametrize("window_um", [2.0, 4.0])
def test_random_places(window_um):
    """Of n points in a window that is a share p of the box, the number is binomial: variance n p (1 - p), mean n p.

    A ball is partly in the window. Two random points of it are both inside for prod(window - |distance|) of its places.
    """
    edges_um, n, radius_um, rng = np.array([12.0, 12.0, 14.0]), 800, 0.4, np.random.default_rng(5)
    some = particles(np.ones(n, dtype=int), radius_um, NAMES)
    found = [
        coarseness(rng.uniform(-20, 20, (n, 3)) * edges_um, -edges_um / 2, edges_um, some, window_um)["A"]
        for _ in range(12)
    ]
    points = rng.uniform(-1, 1, (2, 200_000, 3))
    both = np.all(np.linalg.norm(points, axis=-1) < 1, axis=0)
    distance_um = radius_um * np.abs(points[0, both] - points[1, both])
    p, both_inside = window_um**3 / np.prod(edges_um), np.prod(1 - distance_um / window_um, axis=1).mean()
    expected = np.sqrt((both_inside - p) / (n * p))
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(expected, rel=0.04)


@pytest.mark.parametrize("window_um", [2.0, 4.0])
def test_a_single_sphere(window_um):
    edges_um, rng = np.array([8.0, 10.0, 9.0]), np.random.default_rng(1)
    for radius_um in np.array([[0.3], [0.6], [1.0]]):
        volume_um3 = sphere_volume_um3(2 * radius_um)
        found = [
            window_deviation(rng.random((1, 3)) * 9, np.zeros(3), edges_um, radius_um, volume_um3, window_um) ** 2
            for _ in range(10)
        ]
        assert np.mean(found) == pytest.approx(single_sphere_variance(radius_um, edges_um, window_um)[0], rel=0.06)


@pytest.mark.parametrize("window_um", [2.0, 4.0])
def test_random_mixtures(window_um):
    """Large spheres among small ones: in a gas, and in places of a lattice, taken at random."""
    edges_um, rng = np.array([9.0, 8.0, 12.0]), np.random.default_rng(7)
    sites = lattice((9.0, 8.0, 12.0), 1.0)
    squares = []
    for _ in range(6):
        gas = rng.random(sites.shape) * edges_um
        for position_um in (gas, sites):
            large = rng.random(len(sites)) < 0.3
            radius_um = np.where(large, 0.55, 0.35)
            some = mixing_deviations(position_um, np.zeros(3), edges_um, radius_um, large, window_um)
            rest = mixing_deviations(position_um, np.zeros(3), edges_um, radius_um, ~large, window_um)
            assert some == pytest.approx(rest)  # the shares add up to 1
            squares.append(np.square(some))
    for found, random in np.reshape(squares, (6, 2, 2)).mean(axis=0):
        assert found == pytest.approx(random, rel=0.15)


def test_parted_and_ordered_mixtures():
    edges_um = np.array([8.0, 8.0, 16.0])
    sites = lattice((8.0, 8.0, 16.0), 0.5)
    radius_um = np.full(len(sites), 0.25)
    found, random = mixing_deviations(sites, np.zeros(3), edges_um, radius_um, sites[:, 2] < 8, 2.0)
    assert found == pytest.approx(0.5 * np.sqrt(1 - 4 * 2 / (3 * 16)), rel=0.01)  # as the layers above
    ordered, same = mixing_deviations(
        sites, np.zeros(3), edges_um, radius_um, np.round(sites.sum(axis=1) / 0.5 - 1.5) % 2 == 0, 2.0
    )
    assert ordered < 0.01 * random < 0.1 * found
    assert same == pytest.approx(random)


def test_windows_that_do_not_fit_are_left_out():
    some, position_um = particles(np.array([1, 2, 2]), 0.5, NAMES), np.zeros((3, 3))
    edges_um = np.array([6.1, 9.0, 9.0])
    assert set(coarseness(position_um, -edges_um / 2, edges_um, some, 4.0)) == {"A", "B"}
    assert coarseness(position_um, -edges_um / 2, edges_um - 0.2, some, 4.0) == {}
    wide = particles(np.array([1, 2, 2]), 1.1, NAMES)
    assert coarseness(position_um, -edges_um / 2, edges_um, wide, 2.0) == {}
