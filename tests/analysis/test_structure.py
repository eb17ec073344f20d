"""Structural measures: lattices, two and three spheres, Monte Carlo and LAMMPS' own contacts."""

import numpy as np
import pytest

from slurrycast.analysis.rdf import phase_pairs
from slurrycast.analysis.structure import find_contacts, lens_volume_um3, structure_measures
from slurrycast.data.frames import Particles, read_frames
from slurrycast.runtime.files import InputError
from structures import particles

NAMES = ("A", "B", "C")
EDGES_UM = np.array([9.0, 8.0, 15.0])
LOWER_UM = -EDGES_UM / 2


def rock_salt(cells: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Sites of a simple cubic lattice (n, 3) with constant 1 and their phases, 1 and 2 in turns."""
    sites = np.stack(np.meshgrid(*map(np.arange, cells), indexing="ij"), axis=-1).reshape(-1, 3)
    return sites.astype(float), 1 + sites.sum(axis=1) % 2


@pytest.fixture(scope="module")
def gas() -> tuple[np.ndarray, Particles]:
    """Random positions of 1500 particles of three phases and sizes, some of them outside the box."""
    rng = np.random.default_rng(3)
    phase = rng.integers(1, 4, 1500)
    position_um = LOWER_UM + rng.uniform(-1, 2, (1500, 3)) * EDGES_UM
    return position_um, particles(phase, np.array([0.2, 0.3, 0.45])[phase - 1], NAMES)


@pytest.mark.parametrize(("radius_um", "same", "other"), [(0.49, 0, 0), (0.51, 0, 6), (0.72, 12, 6), (0.87, 12, 14)])
def test_coordination_shells_of_rock_salt(radius_um, same, other):
    # Neighbours of a site at 1 (6, other phase), sqrt(2) (12, same) and sqrt(3) lattice constants (8, other).
    position_um, phase = rock_salt((4, 6, 8))
    images = np.random.default_rng(1).integers(-2, 3, position_um.shape) * [4, 6, 8]
    edges_um = np.array([4.0, 6.0, 8.0])
    some = particles(phase, radius_um, ("A", "B"))
    measures = structure_measures(position_um + images, -edges_um / 2, edges_um, some)
    assert measures["particles"] == 4 * 6 * 8
    assert measures["coordination_A-A"] == measures["coordination_B-B"] == same
    assert measures["coordination_A-B"] == other
    assert measures["coordination_all"] == same + other
    assert measures["share_below_4_contacts"] == (same + other < 4)
    assert measures["overlap_max"] == pytest.approx(max(0, 1 - 0.5 / radius_um))
    assert measures["density_g_cm3"] == pytest.approx(2)
    assert measures["packing_nominal"] == pytest.approx(4 / 3 * np.pi * radius_um**3)
    assert (measures["packing_union"] == measures["packing_nominal"]) == (radius_um < 0.5)


def test_coordination_and_packing_of_a_face_centred_cubic_lattice():
    basis = np.array([[0, 0, 0], [0, 0.5, 0.5], [0.5, 0, 0.5], [0.5, 0.5, 0]])
    position_um = (rock_salt((3, 3, 3))[0][:, None] + basis).reshape(-1, 3)
    touch_um = np.sqrt(2) / 4  # radius at which the 12 neighbours touch
    edges_um = np.full(3, 3.0)
    some = particles(np.ones(len(position_um), dtype=int), 1.01 * touch_um, ("A",))
    measures = structure_measures(position_um, np.zeros(3), edges_um, some)
    assert measures["coordination_all"] == measures["coordination_A-A"] == 12
    assert measures["overlap_mean"] == pytest.approx(1 - 1 / 1.01)
    assert measures["packing_nominal"] == pytest.approx(1.01**3 * np.pi / np.sqrt(18))
    # Six lenses a particle, each of two caps h = R - d / 2 high, of V = pi h^2 (3 R - h) / 3; no three of them meet.
    height_um = 0.01 * touch_um
    caps_um3 = 12 * np.pi * height_um**2 * (3 * 1.01 * touch_um - height_um) / 3
    assert measures["packing_nominal"] - measures["packing_union"] == pytest.approx(4 * caps_um3)


def test_particles_with_few_contacts():
    # A particle between four others that do not touch each other, and one alone.
    position_um = np.array([[0.0, 0, 0], [0.9, 0, 0], [-0.9, 0, 0], [0, 0.9, 0], [0, -0.9, 0], [3, 3, 3]])
    measures = structure_measures(position_um, LOWER_UM, EDGES_UM, particles(np.ones(6, dtype=int), 0.5, NAMES))
    assert measures["share_below_4_contacts"] == pytest.approx(5 / 6)


def test_a_pair_of_two_phases_counts_the_neighbours_of_the_first_one():
    # One A particle between two B particles.
    position_um = np.array([[0.0, 0, 0], [0.9, 0, 0], [-0.8, 0, 0]])
    measures = structure_measures(position_um, LOWER_UM, EDGES_UM, particles(np.array([1, 2, 2]), 0.5, NAMES))
    assert measures["coordination_A-B"] == 2
    assert measures["coordination_B-B"] == 0
    assert measures["coordination_all"] == pytest.approx(4 / 3)
    assert measures["overlap_mean"] == pytest.approx(0.15)
    assert measures["overlap_max"] == pytest.approx(0.2)
    assert "coordination_A-A" not in measures  # one particle forms no pair, and phase C has none


@pytest.mark.parametrize("margin_um", [1e-9, -1e-9])
def test_touching_is_decided_in_double_precision_and_across_the_boundary(margin_um):
    position_um = np.array([[4.0, 3.9, 7.3], [4.0, 3.9, 7.3 + 0.7 - margin_um - 15]])
    contacts = find_contacts(position_um, LOWER_UM, EDGES_UM, np.array([0.3, 0.4]))
    assert len(contacts.first) == (margin_um > 0)
    np.testing.assert_allclose(contacts.distance_um, 0.7, atol=1e-8)


@pytest.mark.parametrize("widening", [1.0, 4.0])
def test_contacts_are_those_of_all_distances(gas, widening):
    """Also for sizes that are far apart."""
    position_um, some = gas
    radius_um = np.where(np.arange(len(position_um)) % 50, 1.0, widening) * some.radius_um
    contacts = find_contacts(position_um, LOWER_UM, EDGES_UM, radius_um)
    difference_um = position_um[:, None] - position_um
    difference_um -= EDGES_UM * np.round(difference_um / EDGES_UM)
    reach_um = radius_um[:, None] + radius_um
    touching = np.triu(np.linalg.norm(difference_um, axis=2) < reach_um, k=1)
    pairs = np.sort(np.stack([contacts.first, contacts.second]), axis=0)
    assert sorted(map(tuple, pairs.T)) == list(map(tuple, np.argwhere(touching)))
    assert len(pairs.T) > 1000


def test_a_box_that_is_too_short_is_refused():
    with pytest.raises(InputError, match=r"box edge 2 um: too short for contacts of particles 1 um wide"):
        find_contacts(np.zeros((1, 3)), np.zeros(3), np.array([2.0, 9, 9]), np.array([0.5]))


def test_lenses():
    assert lens_volume_um3(1.0, 0.5, 0.5) == 0
    assert lens_volume_um3(2.0, 0.5, 0.5) == 0
    sphere_um3 = 4 / 3 * np.pi * 0.2**3
    np.testing.assert_allclose(lens_volume_um3(np.array([0, 0.1, 0.3]), 0.5, 0.2), sphere_um3, rtol=1e-12)
    assert lens_volume_um3(0.0, 0.2, 0.2) == pytest.approx(sphere_um3)
    # Equal spheres: pi (4 R + d) (2 R - d)^2 / 12.
    assert lens_volume_um3(0.6, 0.5, 0.5) == pytest.approx(np.pi * 2.6 * 0.4**2 / 12)
    assert lens_volume_um3(0.5, 0.3, 0.4) == lens_volume_um3(0.5, 0.4, 0.3)


def sampled_union(position_um: np.ndarray, radius_um: np.ndarray, samples: int) -> float:
    """Share of random points of the box that lie in any sphere."""
    points = LOWER_UM + np.random.default_rng(9).random((samples, 3)) * EDGES_UM
    covered = np.zeros(samples, dtype=bool)
    for centre_um, radius in zip(position_um, radius_um, strict=True):
        difference_um = points - centre_um
        difference_um -= EDGES_UM * np.round(difference_um / EDGES_UM)
        covered |= np.einsum("ij,ij->i", difference_um, difference_um) < radius**2
    return float(covered.mean())


def test_union_of_two_spheres_across_the_boundary():
    position_um, radius_um = np.array([[4.3, 0, 0], [-3.9, 0, 0]]), np.array([1.5, 1.2])
    measures = structure_measures(position_um, LOWER_UM, EDGES_UM, particles(np.array([1, 2]), radius_um, NAMES))
    samples = 200_000
    sampled = sampled_union(position_um, radius_um, samples)
    sigma = np.sqrt(sampled / samples)
    assert measures["packing_union"] == pytest.approx(sampled, abs=4 * sigma)
    assert measures["packing_nominal"] > sampled + 10 * sigma


def test_union_of_three_spheres_is_too_small_by_what_they_share():
    position_um, radius_um = np.array([[0.0, 0, 0], [0.5, 0, 0], [0, 0.5, 0]]), np.full(3, 1.0)
    three = structure_measures(position_um, LOWER_UM, EDGES_UM, particles(np.array([1, 1, 1]), radius_um, NAMES))
    assert three["packing_union"] < sampled_union(position_um, radius_um, 50_000) - 1e-3


def test_union_of_a_slurry_as_sampled(gas):
    position_um, some = gas
    few = particles(some.phase[:120], some.radius_um[:120], NAMES)
    measures = structure_measures(position_um[:120], LOWER_UM, EDGES_UM, few)
    sampled = sampled_union(position_um[:120], few.radius_um, 100_000)
    assert measures["packing_union"] == pytest.approx(sampled, abs=4 * np.sqrt(sampled / 100_000))


def test_coordination_as_lammps_counts_it(slurry):
    with read_frames(slurry / "frames.h5") as store:
        for k in (1, 60, 120):
            some, (lower_um, edges_um) = store.particles, store.box(k)
            contacts = find_contacts(store.position_um(k), lower_um, edges_um, some.radius_um)
            ends = np.bincount(np.concatenate([contacts.first, contacts.second]), minlength=len(some))
            np.testing.assert_array_equal(ends, store.coordination(k))
        measures = structure_measures(store.position_um(120), lower_um, edges_um, some)
        assert measures["coordination_all"] == pytest.approx(store.coordination(120).mean())
        assert measures["coordination_all"] > 1
        assert measures["density_g_cm3"] == pytest.approx(store.density_g_cm3(120))
        # A particle's contacts are those with its own phase and with the other ones, seen from either side.
        numbers = {name: some.in_phase(name).sum() for name in some.phase_names}
        ends = sum(
            numbers[a] * measures[f"coordination_{pair}"] * (1 if a == b else 2)
            for pair, (a, b) in phase_pairs(some).items()
        )
        assert ends == pytest.approx(store.coordination(120).sum())
