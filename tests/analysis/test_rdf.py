"""Radial distribution functions: lattice, ideal gas, and InterRDF of MDAnalysis."""

from itertools import combinations_with_replacement

import MDAnalysis
import numpy as np
import pytest
from MDAnalysis.analysis.rdf import InterRDF

from slurrycast.analysis.rdf import (
    bin_centres_um,
    bin_edges_um,
    mean_absolute_difference,
    phase_pairs,
    radial_distributions,
)
from slurrycast.data.frames import Particles, read_frames
from slurrycast.runtime.files import InputError
from structures import particles

NAMES = ("A", "B", "C")
EDGES_UM = np.array([9.0, 8.0, 15.0])
LOWER_UM = -EDGES_UM / 2


@pytest.fixture(scope="module")
def gas() -> tuple[np.ndarray, Particles]:
    """Random positions (3000, 3) of three phases, some of them outside the box."""
    rng = np.random.default_rng(5)
    return LOWER_UM + rng.uniform(-1, 2, (3000, 3)) * EDGES_UM, particles(rng.integers(1, 4, 3000), names=NAMES)


def inter_rdf(position, lower, edges, r_edges, first, second) -> np.ndarray:
    """Curve of InterRDF for the masks `first` and `second`."""
    universe = MDAnalysis.Universe.empty(len(position), trajectory=True)
    universe.atoms.positions = position - lower
    universe.dimensions = [*edges, 90, 90, 90]
    groups = universe.atoms[first], universe.atoms[second]
    itself = (1, 1) if np.array_equal(first, second) else None
    options = {"nbins": len(r_edges) - 1, "range": (0, r_edges[-1]), "exclusion_block": itself}
    return InterRDF(*groups, **options).run().results.rdf


def test_coordination_shells_of_a_simple_cubic_lattice():
    # 6, 12, 8, 6, 24 neighbours at 1, sqrt(2), sqrt(3), 2 and sqrt(5) lattice constants, and none between them. Phases
    # in turns, as in rock salt: neighbours of an odd number of steps are of the other phase.
    position = np.stack(np.meshgrid(*[np.arange(8.0)] * 3), axis=-1).reshape(-1, 3)
    phase = 1 + position.sum(axis=1).astype(int) % 2
    r_edges = np.linspace(0, 2.3, 24)
    curves = radial_distributions(position, np.zeros(3), np.full(3, 8.0), particles(phase, names=NAMES), r_edges)
    expected = {pair: np.zeros(23) for pair in ("all", "A-A", "A-B", "B-B")}
    for radius, number, pairs in (
        (1, 6, ["A-B"]),
        (np.sqrt(2), 12, ["A-A", "B-B"]),
        (np.sqrt(3), 8, ["A-B"]),
        (2, 6, ["A-A", "B-B"]),
        (np.sqrt(5), 24, ["A-B"]),
    ):
        for pair in ("all", *pairs):
            expected[pair][int(radius / 0.1 + 1e-6)] += number
    assert list(curves) == list(expected)
    for pair, others in (("all", 511), ("A-A", 255), ("A-B", 256), ("B-B", 255)):
        # `others` is how many a particle of the first phase can meet in the volume of 512 cells
        neighbours = curves[pair] * others / 512 * 4 / 3 * np.pi * np.diff(r_edges**3)
        np.testing.assert_allclose(neighbours, expected[pair], atol=1e-9)


def test_an_ideal_gas_is_one_everywhere(gas):
    position, some = gas
    r_edges = np.linspace(0, 3.9, 40)
    curves = radial_distributions(position, LOWER_UM, EDGES_UM, some, r_edges)
    numbers = {name: some.in_phase(name).sum() for name in some.phase_names}
    pairs = {name: numbers[a] * (numbers[b] - (a == b)) for name, (a, b) in phase_pairs(some).items()}
    for name, number in ({"all": 3000 * 2999} | pairs).items():
        expected = number / np.prod(EDGES_UM) * 4 / 3 * np.pi * np.diff(r_edges**3)
        # Each pair of a group with itself is counted twice, which doubles the variance of the count.
        sigma = np.sqrt((1 + (name in ("all", "A-A", "B-B", "C-C"))) / expected)
        deviation = (curves[name] - 1) / sigma
        assert np.max(np.abs(deviation)) < 4.5
        assert 0.6 < np.std(deviation) < 1.5


def test_every_curve_is_that_of_inter_rdf(gas):
    position, some = gas
    r_edges = np.linspace(0, 3.9, 68)
    curves = radial_distributions(position, LOWER_UM, EDGES_UM, some, r_edges)
    assert list(curves) == ["all", *("-".join(pair) for pair in combinations_with_replacement("ABC", 2))]
    masks = {pair: tuple(map(some.in_phase, names)) for pair, names in phase_pairs(some).items()}
    masks["all"] = (np.ones(3000, dtype=bool),) * 2
    for pair, g in curves.items():
        reference = inter_rdf(position, LOWER_UM, EDGES_UM, r_edges, *masks[pair])
        # Distances at a bin's edge can fall on either side of it in float32; sparse first bins feel one pair.
        np.testing.assert_allclose(g[5:], reference[5:], rtol=2e-3)
        np.testing.assert_allclose(g[:5], reference[:5], atol=0.05)


def test_curves_of_a_slurry_are_those_of_inter_rdf(slurry):
    with read_frames(slurry / "frames.h5") as store:
        some, position, (lower, edges) = store.particles, store.position_um(120), store.box(120)
    r_edges = bin_edges_um(7.0, 120, [edges])
    curves = radial_distributions(position, lower, edges, some, r_edges)
    everything = np.ones(len(some), dtype=bool)
    np.testing.assert_allclose(
        curves["all"], inter_rdf(position, lower, edges, r_edges, everything, everything), rtol=1e-6, atol=1e-9
    )
    masks = some.in_phase("NiO"), some.in_phase("8YSZ")
    np.testing.assert_allclose(
        curves["NiO-8YSZ"], inter_rdf(position, lower, edges, r_edges, *masks), rtol=1e-6, atol=1e-9
    )


def test_overlapping_particles_are_counted_but_not_a_particle_itself():
    position = np.array([[0.0, 0, 0], [0, 0, 0], [3, 3, 3]])
    r_edges = np.array([0, 0.5, 1.0])
    some = particles(np.array([1, 1, 2]), names=NAMES)
    curves = radial_distributions(position, LOWER_UM, EDGES_UM, some, r_edges)
    assert list(curves) == ["all", "A-A", "A-B"]  # one particle forms no pair, and phase C has none
    shell = 4 / 3 * np.pi * 0.5**3
    np.testing.assert_allclose(curves["all"], [2 / (3 * 2 / np.prod(EDGES_UM) * shell), 0])


def test_centres_of_bins():
    np.testing.assert_allclose(bin_centres_um(np.array([0.0, 0.5, 1.0])), [0.25, 0.75])


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
