"""Checks across keys that a schema cannot express: drying, and the measures of tapes."""

from collections.abc import Iterator, Mapping, Sequence

from slurrycast import surrogates
from slurrycast.analysis.quantity_names import SUMS
from slurrycast.analysis.tortuosity import LEAST_SPACINGS
from slurrycast.analysis.voxels import MOST_VOXELS
from slurrycast.config.composition import wet_composition
from slurrycast.config.dem_checks import and_more, box_edges, long_timestep, particles_per_pg, timestep, whole_particles
from slurrycast.config.formulations import expected_density_g_cm3, of_slurry
from slurrycast.config.schema_errors import down, shown, up
from slurrycast.config.slurry_table import Slurry
from slurrycast.dem import recipe
from slurrycast.dem.drying import dry_force_field, dry_volume_share, drying_types
from slurrycast.runtime.files import InputError

# Liquids that solvents are made of have 0.6 to 1.6; the calibrated density of a coarse phase need not be a real one.
SOLVENTS_G_CM3 = (0.3, 3.0)
# Of the image, across the smallest particle. Slurry 2 of results/reference/reduced with its 0.5 um: pores have a mean
# of 0.27 um with 5 voxels, 0.33 um with 2.5, and 0.75 um, a voxel and a half, with one.
LEAST_VOXELS = 3


def solvent(config: Mapping, _) -> Iterator[str]:
    """The phase that is needed exists, and holds no more solvent than its mass, in a wet composition."""
    settings, phases = config["drying"], config["formulation"]["phases"]
    phase = settings["phase"]
    if phase not in phases:
        if (settings["composition_is"], settings["solvent_fraction_of"]) != ("wet", "phase"):
            yield f"drying.phase = {shown(phase)}: must be one of {', '.join(phases)}, which the solvent is added to"
        elif settings["sources"]:
            yield f"drying.phase = {shown(phase)}: must be one of {', '.join(phases)}; or set drying.sources: []"
    elif settings["solvent_mass_fraction"] >= 1:
        of_phase = phases[phase]["mass_fraction"]
        of_slurry = settings["solvent_mass_fraction"] * of_phase
        yield (
            f"drying.solvent_mass_fraction = {of_slurry:.6g}: must be below {of_phase:.6g}, the mass fraction of "
            f"{phase} in the slurry"
        )


def drying(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """Yield a line for each problem of the drying; none if nothing is dried.

    Parameters
    ----------
    config
        The configuration.
    slurries
        The good rows of the slurry table.
    """
    settings, phases = config["drying"], config["formulation"]["phases"]
    phase, organics_g_cm3 = settings["phase"], settings["organics_density_g_cm3"]
    if not settings["sources"]:
        return
    for source in settings["sources"]:
        try:
            surrogates.parse("affine" if source == "dem" else source)
        except InputError as error:
            yield f"drying.sources: {str(error).removeprefix('surrogate: ')}, or dem"
    if any(solvent(config, slurries)):
        return
    if len(phases) == 1:
        yield f"formulation.phases: {phase} alone: must be a ceramic too, to make a tape; or set drying.sources: []"
    for name in phases:
        if name in SUMS:
            yield (
                f"formulation.phases.{name}: must have another name, since {', '.join(SUMS)} stand for several phases "
                "in the properties of a tape; or set drying.sources: []"
            )
    volume = dry_volume_share(phases[phase]["density_g_cm3"], settings)
    if volume >= 1:
        yield (
            f"drying.organics_density_g_cm3 = {shown(organics_g_cm3)}: must be above {up(volume * organics_g_cm3)}, "
            f"or the particles of {phase} would not shrink; or set drying.sources: []"
        )
        return
    solvent_g_cm3 = settings["solvent_mass_fraction"] * phases[phase]["density_g_cm3"] / (1 - volume)
    lightest, heaviest = SOLVENTS_G_CM3
    if not lightest <= solvent_g_cm3 <= heaviest:
        yield (
            f"drying.solvent_mass_fraction = {shown(settings['solvent_mass_fraction'])}: the solvent would have a "
            f"density of {solvent_g_cm3:.3g} g/cm3, from that of {phase} and of the organics: must be {lightest} to "
            f"{heaviest}; or set drying.sources: []"
        )
    wet = recipe.particle_types(phases)
    dry = drying_types(wet, settings, 0.0)
    force_field = dry_force_field(config["force_field"], settings["force_field"])
    if not any(timestep(config, slurries)):
        timestep_us = settings["timestep_factor"] * config["dem"]["timestep_us"]
        key = "drying.timestep_factor x dem.timestep_us"
        yield from long_timestep(key, timestep_us, config["dem"], [*wet, *dry], force_field)
    if not any(box_edges(config, slurries)):
        yield from _thickness(config, slurries, wet, dry)
        if not any(whole_particles(config, slurries)):
            yield from _voxels(config, slurries)
    spacing_um, most_um = config["microstructure"]["spacing_um"], min(kind.diameter_um for kind in dry) / LEAST_VOXELS
    if spacing_um > most_um:
        yield (
            f"microstructure.spacing_um = {shown(spacing_um)}: must be at most {down(most_um)}, so that the smallest "
            f"particle has {LEAST_VOXELS} voxels across, and pores between such particles are seen; or set "
            "drying.sources: []"
        )


def extrapolation(config: Mapping, _: Sequence[Slurry]) -> Iterator[str]:
    """Yield a line if the tortuosity is to be extrapolated from too few spacings."""
    settings = config["microstructure"]
    spacings_um = settings["tortuosity_spacings_um"]
    if settings["tortuosity_extrapolated"] and len(spacings_um) < LEAST_SPACINGS:
        yield (
            f"microstructure.tortuosity_spacings_um = {shown(spacings_um)}: must be at least {LEAST_SPACINGS} with "
            "microstructure.tortuosity_extrapolated = true"
        )


def _voxels(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """The image of no slurry has too many voxels."""
    spacing_um = config["microstructure"]["spacing_um"]
    largest = max((slurry for slurry in slurries if slurry.role != "train"), key=lambda s: s.mass_units, default=None)
    if largest is None:
        return
    volume_um3 = _volume_um3(config["formulation"], largest)
    if volume_um3 / spacing_um**3 > MOST_VOXELS:
        yield (
            f"microstructure.spacing_um = {shown(spacing_um)}: slurry {largest.id} would have "
            f"{_voxel_limit(volume_um3, spacing_um)}; or set drying.sources: []"
        )


def tortuosity_voxels(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """Yield a line if an image that a tortuosity is solved on may have too many voxels.

    Parameters
    ----------
    config
        The configuration as it is written, with all recipes.
    slurries
        The good rows of the slurry table.
    """
    settings = config["microstructure"]
    if not config["drying"]["sources"] or not settings["tortuosity_spacings_um"]:
        return
    sizes = []
    held_out = [slurry for slurry in slurries if slurry.role not in ("train", "validation")]
    test, new = ([slurry for slurry in held_out if (slurry.role == "new") == is_new] for is_new in (False, True))
    for slurry in [*test[: config["drying"]["test_slurries"]], *new]:
        if slurry.formulation not in ("", *config["formulations"]):
            continue
        recipe_config = wet_composition(of_slurry(config, slurry))
        if any(line for check in (box_edges, whole_particles) for line in check(recipe_config, [slurry])):
            return
        sizes.append((_volume_um3(recipe_config["formulation"], slurry), slurry.id))
    sizes = sizes[: settings["tortuosity_slurries"]]  # of each source the first ones, those of role `new` last
    finest_um = min(settings["tortuosity_spacings_um"])
    volume_um3, slurry_id = max(sizes, default=(0, ""))
    if volume_um3 / finest_um**3 > MOST_VOXELS:
        yield (
            f"microstructure.tortuosity_spacings_um = {shown(settings['tortuosity_spacings_um'])}: slurry {slurry_id} "
            f"may have {_voxel_limit(volume_um3, finest_um)}; or set microstructure.tortuosity_slurries: 0"
        )


def _volume_um3(formulation: Mapping, slurry: Slurry) -> float:
    return slurry.mass_units * formulation["unit_mass_pg"] / expected_density_g_cm3(formulation)


def _voxel_limit(volume_um3: float, spacing_um: float) -> str:
    """How many voxels there would be, and what spacing is allowed."""
    return (
        f"{volume_um3 / spacing_um**3:.2g} voxels, at most {MOST_VOXELS:.2g} are allowed: must be at least "
        f"{up((volume_um3 / MOST_VOXELS) ** (1 / 3), 3)}"
    )


def _thickness(
    config: Mapping,
    slurries: Sequence[Slurry],
    wet: Sequence[recipe.ParticleType],
    dry: Sequence[recipe.ParticleType],
) -> Iterator[str]:
    """No particle of a tape touches two periodic images of another one, which would share one contact history."""
    formulation = config["formulation"]
    counts = particles_per_pg(wet)
    # the particles of a tape are packed no closer than those of the slurry
    shrinkage = recipe.mean_volume_um3(dry, counts) / recipe.mean_volume_um3(wet, counts)
    pg_per_unit_um3 = formulation["unit_mass_pg"] / expected_density_g_cm3(formulation)
    least_um = 2 * max(t.diameter_um for t in dry)
    thin = []
    for slurry in slurries:
        edges_um = recipe.box_edges_um(slurry.mass_units * pg_per_unit_um3, slurry.thickness_ratio)
        if slurry.role != "train" and shrinkage * edges_um[2] <= least_um:
            thin.append((shrinkage * edges_um[2], slurry.id))
    if thin:
        thickness_um, slurry_id = min(thin)
        yield (
            f"formulation.unit_mass_pg: slurry {slurry_id} may dry to a thickness of {thickness_um:.4g} um: must be "
            f"above {up(least_um)} um, twice the largest diameter{and_more(len(thin))}; or set drying.sources: []"
        )
