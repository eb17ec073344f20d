"""Radial distribution functions: lattice, ideal gas, InterRDF and freud."""

import freud
import MDAnalysis
import numpy as np
import pytest
from MDAnalysis.analysis.rdf import InterRDF

from slurrycast.analysis import rdf
from slurrycast.analysis.rdf import bin_edges_um, mean_absolute_difference, radial_distribution
from slurrycast.runtime.files import InputError

EDGES_UM = np.array([9.0, 8.0, 15.0])
LOWER_UM = -EDGES_UM / 2


@pytest.fixture(scope="module")
def gas() -> tuple[np.ndarray, np.ndarray]:
    """Random positions (3000, 3), some of them outside the box, and a mask of a third of them."""
    rng = np.random.default_rng(5)
    return LOWER_UM + rng.uniform(-1, 2, (3000, 3)) * EDGES_UM, rng.random(3000) < 1 / 3


def everything(position: np.ndarray) -> np.ndarray:
    return np.ones(len(position), dtype=bool)


def inter_rdf(position, first, second, r_edges, **options) -> np.ndarray:
    """Curve of InterRDF for the masks `first` and `second`."""
    universe = MDAnalysis.Universe.empty(len(position), trajectory=True)
    universe.atoms.positions = position - LOWER_UM
    universe.dimensions = [*EDGES_UM, 90, 90, 90]
    groups = universe.atoms[first], universe.atoms[second]
    return InterRDF(*groups, nbins=len(r_edges) - 1, range=(0, r_edges[-1]), **options).run().results.rdf


def test_coordination_shells_of_a_simple_cubic_lattice():
    # 6, 12, 8, 6, 24 neighbours at 1, sqrt(2), sqrt(3), 2 and sqrt(5) lattice constants, and none between them.
    position = np.stack(np.meshgrid(*[np.arange(8.0)] * 3), axis=-1).reshape(-1, 3)
    r_edges = np.linspace(0, 2.3, 24)
    edges = np.full(3, 8.0)
    g = radial_distribution(position, np.zeros(3), edges, r_edges, everything(position), everything(position))
    density = (512 - 1) / 512  # particles per cell that a particle can meet, over the volume of the cell
    neighbours = g * density * 4 / 3 * np.pi * np.diff(r_edges**3)
    expected = np.zeros(23)
    for radius, number in ((1, 6), (np.sqrt(2), 12), (np.sqrt(3), 8), (2, 6), (np.sqrt(5), 24)):
        expected[int(radius / 0.1 + 1e-6)] += number
    np.testing.assert_allclose(neighbours, expected, atol=1e-9)


def test_an_ideal_gas_is_one_everywhere(gas):
    position, third = gas
    r_edges = np.linspace(0, 3.9, 40)
    for first, second in ((everything(position), everything(position)), (third, ~third)):
        pairs = np.sum(first) * (np.sum(second) - np.array_equal(first, second))
        expected = pairs / np.prod(EDGES_UM) * 4 / 3 * np.pi * np.diff(r_edges**3)
        # Each pair of a group with itself is counted twice, which doubles the variance of the count.
        sigma = np.sqrt((1 + np.array_equal(first, second)) / expected)
        deviation = (radial_distribution(position, LOWER_UM, EDGES_UM, r_edges, first, second) - 1) / sigma
        assert np.max(np.abs(deviation)) < 4.5
        assert 0.6 < np.std(deviation) < 1.5


def test_all_particles_as_inter_rdf_with_exclusion_of_self(gas):
    position = gas[0]
    r_edges = np.linspace(0, 3.9, 68)
    theirs = inter_rdf(position, everything(position), everything(position), r_edges, exclusion_block=(1, 1))
    ours = radial_distribution(position, LOWER_UM, EDGES_UM, r_edges, everything(position), everything(position))
    # Distances at a bin's edge can fall on either side of it in float32; sparse first bins feel one pair.
    np.testing.assert_allclose(ours[5:], theirs[5:], rtol=1e-3)
    np.testing.assert_allclose(ours[:5], theirs[:5], atol=0.05)


def test_a_pair_of_phases_as_inter_rdf(gas):
    position, third = gas
    r_edges = np.linspace(0, 3.9, 68)
    ours = radial_distribution(position, LOWER_UM, EDGES_UM, r_edges, third, ~third)
    np.testing.assert_allclose(ours[5:], inter_rdf(position, third, ~third, r_edges)[5:], rtol=2e-3)
    swapped = radial_distribution(position, LOWER_UM, EDGES_UM, r_edges, ~third, third)
    np.testing.assert_allclose(ours[5:], swapped[5:], rtol=2e-3)


def test_against_freud(gas):
    position, third = gas
    r_edges = np.linspace(0, 3.9, 68)
    box = freud.box.Box(*EDGES_UM)  # centred at the origin
    wrapped = box.wrap(position)
    theirs = freud.density.RDF(bins=67, r_max=3.9).compute((box, wrapped)).rdf
    ours = radial_distribution(position, LOWER_UM, EDGES_UM, r_edges, everything(position), everything(position))
    n = len(position)
    # freud's ideal gas has n neighbours around a particle of the n, ours has n - 1.
    np.testing.assert_allclose(ours[5:], theirs[5:] * n / (n - 1), rtol=1e-3)
    theirs = freud.density.RDF(bins=67, r_max=3.9).compute((box, wrapped[~third]), query_points=wrapped[third]).rdf
    ours = radial_distribution(position, LOWER_UM, EDGES_UM, r_edges, third, ~third)
    np.testing.assert_allclose(ours[5:], theirs[5:], rtol=2e-3)


@pytest.mark.parametrize("distances", [1, 3001, 40_000])
def test_slices_do_not_change_the_curve(gas, monkeypatch, distances):
    position, third = gas[0][:300], gas[1][:300]
    r_edges = np.linspace(0, 3.9, 40)
    for first, second in ((everything(position), everything(position)), (third, third), (third, ~third)):
        whole = radial_distribution(position, LOWER_UM, EDGES_UM, r_edges, first, second)
        with monkeypatch.context() as patch:
            patch.setattr(rdf, "DISTANCES_AT_A_TIME", distances)
            sliced = radial_distribution(position, LOWER_UM, EDGES_UM, r_edges, first, second)
        np.testing.assert_array_equal(sliced, whole)


def test_overlapping_particles_are_counted_but_not_a_particle_itself():
    position = np.array([[0.0, 0, 0], [0, 0, 0], [3, 3, 3]])
    g = radial_distribution(
        position, LOWER_UM, EDGES_UM, np.array([0, 0.5, 1.0]), everything(position), everything(position)
    )
    shell = 4 / 3 * np.pi * 0.5**3
    np.testing.assert_allclose(g, [2 / (3 * 2 / np.prod(EDGES_UM) * shell), 0])


@pytest.mark.parametrize(
    ("boxes", "bins"),
    [
        ([np.full(3, 50.0)], 120),
        ([np.full(3, 7 / 0.49 + 1e-6)], 120),
        ([np.full(3, 50.0), np.array([30.0, 10.0, 20.0])], 84),  # 4.9 um in bins of 7/120 um: 84 exactly
        ([np.array([9.99, 10.0, 20.0])], 83),
    ],
)
def test_bins_end_before_half_the_shortest_edge(boxes, bins):
    r_edges = bin_edges_um(7.0, 120, boxes)
    assert len(r_edges) == bins + 1
    np.testing.assert_allclose(np.diff(r_edges), 7 / 120)
    assert r_edges[0] == 0
    assert r_edges[-1] <= min(7.0, 0.49 * min(box.min() for box in boxes)) + 1e-9


def test_a_box_too_short_for_a_bin_is_refused():
    with pytest.raises(InputError, match=r"box edge 0\.1 um"):
        bin_edges_um(7.0, 120, [np.array([9.0, 0.1, 9.0])])


def test_mean_absolute_difference():
    assert mean_absolute_difference(np.array([0.0, 1, 2]), np.array([1.0, 1, 0])) == pytest.approx(1.0)
