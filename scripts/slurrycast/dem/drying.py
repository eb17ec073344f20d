"""Drying as shrinking particles: how volume and mass of one phase follow the solvent that is left. Pure functions.

A particle of the phase that dries holds solvent and organics. Mass and volume fall linearly with the share of the
solvent that is left, from those of the wet particle to those of its organics alone. All other particles stay as they
are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from slurrycast.dem.forcefield import coefficients
from slurrycast.dem.recipe import ParticleType


def dry_volume_share(wet_density_g_cm3: float, settings: Mapping) -> float:
    """Volume of the organics over that of the wet particle.

    Parameters
    ----------
    wet_density_g_cm3
        Density of the wet particle.
    settings
        Section drying of the configuration.
    """
    organics_g_cm3 = (1 - settings["solvent_mass_fraction"]) * wet_density_g_cm3
    return organics_g_cm3 / settings["organics_density_g_cm3"]


def drying_types(types: Sequence[ParticleType], settings: Mapping, solvent_left: float) -> list[ParticleType]:
    """The particle types when a share of the solvent is left.

    Parameters
    ----------
    types
        The types of the wet slurry.
    settings
        Section drying of the configuration.
    solvent_left
        From 1, the slurry, to 0, the dry tape.
    """
    return [_dried(t, settings, solvent_left) if t.phase == settings["phase"] else t for t in types]


def _dried(wet: ParticleType, settings: Mapping, solvent_left: float) -> ParticleType:
    dry_volume = dry_volume_share(wet.density_g_cm3, settings)
    volume = dry_volume + solvent_left * (1 - dry_volume)  # both as shares of the wet particle
    mass = 1 - (1 - solvent_left) * settings["solvent_mass_fraction"]
    return replace(
        wet,
        diameter_um=wet.diameter_um * float(np.cbrt(volume)),
        density_g_cm3=wet.density_g_cm3 * mass / volume,
    )


def dry_force_field(force_field: Mapping, settings: Mapping) -> dict:
    """Section force_field as it holds while the slurry dries.

    Parameters
    ----------
    force_field
        That of the slurry.
    settings
        Section drying.force_field: friction, the same for all pairs, and factors on attraction and stiffness of each.
    """
    factors = {
        "epsilon_fj_per_um": settings["attraction_factor"],
        "normal_stiffness_kpa": settings["stiffness_factor"],
    }

    def dried(parameters: Mapping) -> dict:
        dry = {name: factors.get(name, 1) * value for name, value in parameters.items()}
        return dry | {"friction": settings["friction"]} if "friction" in dry else dry

    pairs = {pair: dried(parameters) for pair, parameters in force_field.get("pairs", {}).items()}
    return {
        "lennard_jones": dried(force_field["lennard_jones"]),
        "granular_hertz": dried(force_field["granular_hertz"]),
    } | ({"pairs": pairs} if pairs else {})


def stage_commands(types: Sequence[ParticleType], phase: str, force_field: Mapping) -> str:
    """LAMMPS commands that set the particles of a stage: their size and density, and the forces that follow.

    Parameters
    ----------
    types
        All particle types as they are in this stage.
    phase
        The phase that shrinks.
    force_field
        Section force_field as it holds while the slurry dries.
    """
    # the diameter first, since a density sets the mass of a particle as large as it is then
    lines = [
        f"set type {t.type} diameter {t.diameter_um!r} density {t.density_g_cm3!r}" for t in types if t.phase == phase
    ]
    return "\n".join(["# um, g/cm3", *lines, coefficients(types, force_field)])
