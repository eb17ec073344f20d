"""Compositions with and without solvent: masses balance."""

import pytest

from slurrycast.config import configuration
from slurrycast.config.composition import wet_composition


def fractions(config):
    return {name: phase["mass_fraction"] for name, phase in config["formulation"]["phases"].items()}


@pytest.mark.parametrize("fraction_of", ["phase", "slurry"])
@pytest.mark.parametrize("solvent", [0.0, 0.05, 0.7])
def test_a_dry_composition_and_its_solvent(config, solvent, fraction_of):
    config["drying"] |= {"composition_is": "dry", "solvent_fraction_of": fraction_of, "solvent_mass_fraction": solvent}
    wet = wet_composition(config)
    share = wet["drying"]["solvent_mass_fraction"]
    now, before = fractions(wet), fractions(config)
    assert sum(now.values()) == pytest.approx(1, rel=1e-12)
    solvent_of_slurry = share * now["BDPD"]
    assert (share if fraction_of == "phase" else solvent_of_slurry) == pytest.approx(solvent, rel=1e-12)
    tape = now | {"BDPD": now["BDPD"] - solvent_of_slurry}  # without the solvent
    assert {name: mass / (1 - solvent_of_slurry) for name, mass in tape.items()} == pytest.approx(before, rel=1e-12)
    assert wet_composition(wet) == wet


def test_solvent_as_a_share_of_a_wet_slurry(config):
    config["drying"] |= {"solvent_mass_fraction": 0.0772, "solvent_fraction_of": "slurry"}
    wet = wet_composition(config)
    assert fractions(wet) == pytest.approx(fractions(config))
    assert wet["drying"]["solvent_mass_fraction"] == pytest.approx(0.0772 / 0.13)


def test_the_shipped_composition_is_wet_already(config):
    assert wet_composition(config) == config


def test_sums_that_are_wrong_stay_wrong(config, in_empty_project):
    config["formulation"]["phases"]["NiO"]["mass_fraction"] = 0.6
    config["drying"]["composition_is"] = "dry"
    assert "formulation.phases: mass fractions sum to 1.08: must be 1 within 1e-06" in configuration.check(config)


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        (
            {"solvent_fraction_of": "slurry", "solvent_mass_fraction": 0.2},
            "drying.solvent_mass_fraction = 0.2: must be below 0.13, the mass fraction of BDPD in the slurry",
        ),
        (
            {"composition_is": "dry", "phase": "binder", "sources": []},
            'drying.phase = "binder": must be one of BDPD, NiO, 8YSZ, which the solvent is added to',
        ),
    ],
)
def test_solvent_that_no_phase_holds(config, in_empty_project, settings, line):
    config["drying"] |= settings
    assert configuration.check(config) == [line]
