"""Composition arithmetic against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from configurations import ROOT, load, read_slurries
from formulations import phase
from slurrycast.dem import recipe


@pytest.fixture(scope="module")
def phases() -> dict:
    return load("config")["formulation"]["phases"]


@pytest.fixture(scope="module")
def types(phases) -> list[recipe.ParticleType]:
    return recipe.particle_types(phases)


def unit_mass_pg(scale: str) -> float:
    return load(scale)["formulation"]["unit_mass_pg"]


def phases_of(fractions: list[float]) -> dict:
    """Phases A, B, ... of one size class of 1 um and 1 g/cm3 each."""
    return {chr(65 + i): phase(fraction, 1.0, {1.0: 1.0}) for i, fraction in enumerate(fractions)}


def test_types_follow_the_configuration(types):
    assert [(t.type, t.phase, t.phase_index, t.size_class, t.diameter_um) for t in types] == [
        (1, "BDPD", 1, 1, 1.1),
        (2, "NiO", 2, 1, 0.6),
        (3, "NiO", 2, 2, 0.8),
        (4, "NiO", 2, 3, 1.0),
        (5, "8YSZ", 3, 1, 0.5),
        (6, "8YSZ", 3, 2, 0.7),
        (7, "8YSZ", 3, 3, 0.9),
    ]


def test_particle_mass_is_density_times_volume_of_a_sphere(types):
    assert types[3].volume_um3 == pytest.approx(4 / 3 * np.pi * 0.5**3)
    assert types[3].mass_pg == pytest.approx(6.67 * 4 / 3 * np.pi * 0.5**3)


def test_counts_of_equal_spheres_are_mass_over_particle_mass():
    types = recipe.particle_types({"A": phase(0.25, 2.0, {1.0: 1.0}), "B": phase(0.75, 6.0, {1.0: 1.0})})
    particle_pg = np.pi / 6 * 2.0
    # 0.25 x 800 particles' masses of phase A; B is three times heavier and three times the mass
    assert recipe.particle_counts(types, 800 * particle_pg).tolist() == [200, 200]


def test_classes_share_their_phase_by_number_with_nothing_lost():
    types = recipe.particle_types({"A": phase(1.0, 1.0, {1: 0.3, 2: 0.4, 3: 0.3})})
    mean_pg = np.pi / 6 * (0.3 * 1 + 0.4 * 8 + 0.3 * 27)
    assert recipe.particle_counts(types, 10 * mean_pg).tolist() == [3, 4, 3]
    # 11 particles: 3.3, 4.4, 3.3 exactly; the one left goes to the largest remainder
    assert recipe.particle_counts(types, 11 * mean_pg).tolist() == [3, 5, 3]


@given(
    mass_pg=st.floats(1, 1e6),
    weights=st.lists(st.floats(0.01, 1), min_size=1, max_size=5),
)
def test_whole_particles_miss_a_phase_by_half_a_particle_at_most(mass_pg, weights):
    fractions = np.array(weights) / np.sum(weights)
    types = recipe.particle_types(phases_of(fractions.tolist()))
    counts = recipe.particle_counts(types, mass_pg)
    exact = fractions * mass_pg / types[0].mass_pg
    assert np.all(np.abs(counts - exact) <= 0.5 * (1 + 1e-9))


@given(
    total=st.integers(0, 10_000),
    shares=st.lists(st.floats(0.01, 1), min_size=1, max_size=6),
)
def test_number_fractions_are_met_within_one_particle(total, shares):
    phases = phases_of([1.0])
    phases["A"]["size_classes"] = [{"diameter_um": 1.0, "number_fraction": share} for share in shares]
    types = recipe.particle_types(phases)
    counts = recipe.particle_counts(types, total * types[0].mass_pg)
    assert counts.sum() == total
    assert np.all(np.abs(counts - total * np.array(shares) / np.sum(shares)) < 1 + 1e-6)


@pytest.mark.parametrize("mass_units", [1, 2, 2.6, 3, 4, 5])
def test_mass_fractions_within_half_a_percent_at_the_published_scale(types, phases, mass_units):
    reached = recipe.mass_fractions(types, recipe.particle_counts(types, mass_units * unit_mass_pg("published")))
    for name, settings in phases.items():
        assert reached[name] == pytest.approx(settings["mass_fraction"], rel=0.005)
    assert sum(reached.values()) == pytest.approx(1)


def test_the_published_scale_has_the_published_number_of_training_particles(types):
    masses = [s.mass_units for s in read_slurries(ROOT / "config" / "slurries_published.tsv") if s.role == "train"]
    total = sum(recipe.particle_counts(types, mass * unit_mass_pg("published")).sum() for mass in masses)
    assert total == pytest.approx(131_936, rel=0.01)  # Le-Dinh et al. 2026


@pytest.mark.parametrize(
    ("scale", "low", "high"),
    [("tiny", 100, 150), ("config", 590, 610), ("reduced", 1765, 1785), ("published", 7000, 7200)],
)
def test_particles_of_a_unit(types, scale, low, high):
    assert low <= recipe.particle_counts(types, unit_mass_pg(scale)).sum() <= high


@given(volume_um3=st.floats(1e-3, 1e6), ratio=st.floats(0.01, 100))
def test_box_has_the_volume_and_the_ratio(volume_um3, ratio):
    edges = recipe.box_edges_um(volume_um3, ratio)
    assert np.prod(edges) == pytest.approx(volume_um3)
    assert edges[0] == edges[1] and edges[2] / edges[0] == pytest.approx(ratio)


def test_random_positions_fill_the_centred_box():
    edges = np.array([2.0, 4.0, 8.0])
    positions = recipe.random_positions_um(20_000, edges, np.random.default_rng(1))
    assert np.all(np.abs(positions) <= edges / 2)
    # a uniform coordinate has mean 0 and variance edge^2 / 12; five standard errors
    assert np.all(np.abs(positions.mean(axis=0)) < 5 * edges / np.sqrt(12 * 20_000))
    assert positions.var(axis=0) == pytest.approx(edges**2 / 12, rel=0.05)


def test_seeds_differ_by_purpose_and_seed_and_are_stable():
    assert recipe.derived_seed(1001, "positions") == recipe.derived_seed(1001, "positions")
    seeds = {recipe.derived_seed(seed, purpose) for seed in range(1, 200) for purpose in ("positions", "velocities")}
    assert len(seeds) == 2 * 199


@given(seed=st.integers(1, 2**31 - 1), purpose=st.text())
def test_seeds_are_in_the_range_of_lammps(seed, purpose):
    assert 1 <= recipe.derived_seed(seed, purpose) <= 2**31 - 1
