"""Particles that lose their solvent, against closed forms."""

import numpy as np
import pytest

from formulations import phase
from slurrycast.dem.drying import dry_force_field, dry_volume_share, drying_types, stage_commands
from slurrycast.dem.forcefield import CONTACT
from slurrycast.dem.recipe import particle_types

PHASES = {"binder": phase(0.2, 0.8, {1.0: 0.5, 2.0: 0.5}), "oxide": phase(0.8, 6.0, {0.5: 1.0})}
WET = particle_types(PHASES)
SETTINGS = {"phase": "binder", "solvent_mass_fraction": 0.5, "organics_density_g_cm3": 1.6}
VOLUME = 0.25  # 0.5 x 0.8 / 1.6


def test_volume_of_the_organics():
    assert dry_volume_share(0.8, SETTINGS) == pytest.approx(VOLUME, rel=1e-15)


@pytest.mark.parametrize("left", [1.0, 0.75, 0.5, 0.0])
def test_volume_and_mass_are_linear_in_the_solvent_left(left):
    *binder, oxide = drying_types(WET, SETTINGS, left)
    assert oxide == WET[2]
    for then, wet in zip(binder, WET, strict=False):
        assert then.volume_um3 / wet.volume_um3 == pytest.approx(VOLUME + left * (1 - VOLUME), rel=1e-12)
        assert then.mass_pg / wet.mass_pg == pytest.approx(0.5 + left * 0.5, rel=1e-12)
        # what is not solvent has the mass of the organics
        assert then.mass_pg - left * 0.5 * wet.mass_pg == pytest.approx(0.5 * wet.mass_pg, rel=1e-12)


def test_wet_and_dry_ends():
    wet, dry = (drying_types(WET, SETTINGS, left) for left in (1.0, 0.0))
    for then, before in zip(wet, WET, strict=True):
        assert (then.diameter_um, then.density_g_cm3) == pytest.approx((before.diameter_um, before.density_g_cm3))
    assert [t.density_g_cm3 for t in dry] == pytest.approx([1.6, 1.6, 6.0], rel=1e-12)
    assert [t.diameter_um for t in dry] == pytest.approx([np.cbrt(0.25), 2 * np.cbrt(0.25), 0.5], rel=1e-12)


def test_commands_of_a_stage():
    attraction = {"epsilon_fj_per_um": 2.0, "sigma_factor": 0.9, "cutoff_factor": 1.5}
    dry = drying_types(WET, SETTINGS, 0.0)
    force_field = {"lennard_jones": attraction, "granular_hertz": dict.fromkeys(CONTACT, 0.1)}
    lines = stage_commands(dry, "binder", force_field).splitlines()
    assert lines[1:3] == [f"set type {t.type} diameter {t.diameter_um!r} density {t.density_g_cm3!r}" for t in dry[:2]]
    (of_ends,) = (line.split() for line in lines if line.startswith("pair_coeff 1 3 lj/cut"))
    a, b = dry[0].diameter_um, 0.5
    mean_um = (a + b) / 2
    assert list(map(float, of_ends[4:])) == pytest.approx([2 * np.sqrt(a * b), 0.9 * mean_um, 1.5 * mean_um])


def test_dry_force_field_is_that_of_the_slurry_but_for_its_settings():
    slurry = {
        "lennard_jones": {"epsilon_fj_per_um": 2.0, "sigma_factor": 0.9},
        "granular_hertz": {"normal_stiffness_kpa": 1e5, "tangential_stiffness_ratio": 0.3, "friction": 0.01},
    }
    same = {"friction": 0.01, "attraction_factor": 1.0, "stiffness_factor": 1.0}
    assert dry_force_field(slurry, same) == slurry
    assert dry_force_field(slurry, {"friction": 0.5, "attraction_factor": 3.0, "stiffness_factor": 0.5}) == {
        "lennard_jones": {"epsilon_fj_per_um": 6.0, "sigma_factor": 0.9},
        "granular_hertz": {"normal_stiffness_kpa": 5e4, "tangential_stiffness_ratio": 0.3, "friction": 0.5},
    }
    slurry["pairs"] = {"A-B": {"epsilon_fj_per_um": 1.0, "normal_stiffness_kpa": 3e5, "friction": 0.1}}
    assert dry_force_field(slurry, {"friction": 0.5, "attraction_factor": 3.0, "stiffness_factor": 0.5})["pairs"] == {
        "A-B": {"epsilon_fj_per_um": 3.0, "normal_stiffness_kpa": 1.5e5, "friction": 0.5}
    }
