"""Pair coefficients against golden files and mixing rules, time step limits against closed forms."""

import dataclasses
from itertools import combinations_with_replacement

import numpy as np
import pytest

from configurations import ROOT, load
from slurrycast.dem import forcefield, recipe

CONFIG = load("config")
FORCE_FIELD = CONFIG["force_field"]
LENNARD_JONES = FORCE_FIELD["lennard_jones"]
TYPES = recipe.particle_types(CONFIG["formulation"]["phases"])


def sphere(diameter_um: float, density_g_cm3: float) -> recipe.ParticleType:
    return recipe.ParticleType(1, "A", 1, 1, diameter_um, density_g_cm3, 1.0, 1.0)


def stiff(stiffness_kpa: float, **pairs: dict) -> dict:
    """The shipped forces with another stiffness, and with forces of their own for pairs."""
    return FORCE_FIELD | {
        "granular_hertz": FORCE_FIELD["granular_hertz"] | {"normal_stiffness_kpa": stiffness_kpa},
        "pairs": pairs,
    }


def coefficient_rows(text: str, style: str) -> dict[tuple[int, int], list[float]]:
    rows = (line.split() for line in text.splitlines() if not line.startswith("#") and "*" not in line)
    return {(int(row[1]), int(row[2])): [float(x) for x in row[3:] if x != style] for row in rows}


def test_coefficients_match_the_golden_files():
    golden = ROOT / "tests" / "dem" / "golden"
    assert forcefield.coefficients(TYPES, FORCE_FIELD) == (golden / "coefficients.lmp").read_text()
    assert forcefield.push_off_coefficients(TYPES) == (golden / "push_off.lmp").read_text()


@pytest.mark.parametrize("number", range(1, len(TYPES) + 1))
def test_every_pair_is_written_once(number):
    pairs = list(combinations_with_replacement(range(1, number + 1), 2))
    for text in (
        forcefield.coefficients(TYPES[:number], FORCE_FIELD),
        forcefield.push_off_coefficients(TYPES[:number]),
    ):
        lines = [line.split() for line in text.splitlines() if line.startswith("pair_coeff") and "*" not in line]
        assert [(int(line[1]), int(line[2])) for line in lines] == pairs


def test_mixing():
    rows = coefficient_rows(forcefield.coefficients(TYPES, FORCE_FIELD), "lj/cut")
    # BDPD 1.1 um with NiO 0.8 um: d = 0.95 um
    assert rows[1, 3] == pytest.approx([np.sqrt(1.1 * 0.8), 0.89 * 0.95, 1.5 * 0.95])
    assert rows[5, 5] == pytest.approx([0.5, 0.89 * 0.5, 1.5 * 0.5])
    soft = coefficient_rows(forcefield.push_off_coefficients(TYPES), "")
    assert soft[1, 3] == [1.0, 0.95]


def test_lennard_jones_minimum_lies_at_contact():
    for (i, j), (_, sigma_um, _) in coefficient_rows(forcefield.coefficients(TYPES, FORCE_FIELD), "lj/cut").items():
        contact_um = (TYPES[i - 1].diameter_um + TYPES[j - 1].diameter_um) / 2
        assert 2 ** (1 / 6) * sigma_um == pytest.approx(contact_um, rel=0.002)


def test_largest_cutoff_is_that_of_the_largest_particle_and_covers_contact():
    assert forcefield.largest_cutoff_um(TYPES, LENNARD_JONES) == pytest.approx(1.5 * 1.1)
    assert forcefield.largest_cutoff_um(TYPES, {"cutoff_factor": 0.5}) == 1.1
    cutoffs = [row[2] for row in coefficient_rows(forcefield.coefficients(TYPES, FORCE_FIELD), "lj/cut").values()]
    assert forcefield.largest_cutoff_um(TYPES, LENNARD_JONES) == pytest.approx(max(cutoffs))


def rayleigh_us(*args) -> float:
    """The shortest Rayleigh time."""
    return min(forcefield.rayleigh_times_us(*args).values())


def hertz_us(*args) -> float:
    """The shortest duration of a contact."""
    return min(forcefield.hertz_times_us(*args).values())


def test_rayleigh_time_of_the_binder_is_the_shortest():
    assert rayleigh_us(TYPES, FORCE_FIELD) == pytest.approx(5.2e-3, rel=0.005)
    times_us = forcefield.rayleigh_times_us(TYPES, FORCE_FIELD)
    assert min(times_us, key=times_us.get) == (0,) and len(times_us) == len(TYPES)


def test_rayleigh_time_in_closed_form():
    # G = 0.525 k_n; with k_n = 1 / 0.525 kPa, R = 1 um and 1 g/cm3 it is pi / (0.1631 x 0.3 + 0.8766) us
    assert rayleigh_us([sphere(2.0, 1.0)], stiff(1 / 0.525)) == pytest.approx(np.pi / 0.92553)
    base = rayleigh_us([sphere(1.0, 2.0)], stiff(1e5))
    assert rayleigh_us([sphere(3.0, 2.0)], stiff(1e5)) == pytest.approx(3 * base)
    assert rayleigh_us([sphere(1.0, 8.0)], stiff(1e5)) == pytest.approx(2 * base)
    assert rayleigh_us([sphere(1.0, 2.0)], stiff(4e5)) == pytest.approx(base / 2)


def test_times_are_those_of_the_stiffest_pair():
    """Of the pair's own particles: a pair that is stiffer shortens no times of others."""
    two = [sphere(1.0, 2.0), dataclasses.replace(sphere(2.0, 2.0), phase="B")]
    soft, stiff_pair = stiff(1e5), stiff(1e5, **{"B-A": {"normal_stiffness_kpa": 4e5}})
    large = stiff(1e5, **{"B-B": {"normal_stiffness_kpa": 2e5}})
    for times in (rayleigh_us, lambda *args: hertz_us(*args, 0.1)):
        assert times(two, stiff_pair) < times(two, large) == times(two, soft)
    assert rayleigh_us(two, stiff_pair) == pytest.approx(rayleigh_us(two, soft) / 2)


def integrated_contact_us(mass_pg: float, radius_um: float, stiffness_kpa: float, speed_um_us: float) -> float:
    """Duration of an undamped contact with the force of gran/hertz, k_n sqrt(R_eff) delta^1.5, by small steps.

    LAMMPS' sqrt(delta) sqrt(R_eff) k_n delta with k_n = 4/3 E*.
    """
    dt_us = 1e-5 * (mass_pg**2 / (radius_um * stiffness_kpa**2 * speed_um_us)) ** 0.2
    overlap_um, time_us = 0.5 * speed_um_us * dt_us, 0.0
    while overlap_um > 0:  # leapfrog: the overlap runs half a step ahead
        speed_um_us -= dt_us * stiffness_kpa * np.sqrt(radius_um) * overlap_um**1.5 / mass_pg
        overlap_um += dt_us * speed_um_us
        time_us += dt_us
    return time_us


@pytest.mark.parametrize("other", [sphere(1.0, 2.0), sphere(3.0, 5.0)], ids=["equal", "unequal"])
def test_hertz_time_is_that_of_an_integrated_contact(other):
    """Of one sphere of 0.5 um with another one: 1 / R = 1 / R1 + 1 / R2, and masses likewise."""
    one = sphere(1.0, 2.0)
    mass_pg = one.mass_pg * other.mass_pg / (one.mass_pg + other.mass_pg)
    radius_um = 0.5 * other.diameter_um / 2 / (0.5 + other.diameter_um / 2)
    expected = integrated_contact_us(mass_pg, radius_um, 2e5, 0.1)
    assert forcefield.hertz_times_us([one, other], stiff(2e5), 0.1)[0, 1] == pytest.approx(expected, rel=0.002)


def test_hertz_time_is_that_of_the_shortest_pair():
    base = hertz_us(TYPES, FORCE_FIELD, 0.1)
    assert hertz_us(TYPES, FORCE_FIELD, 3.2) == pytest.approx(base / 2)
