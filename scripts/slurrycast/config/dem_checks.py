"""Checks across keys that a schema cannot express: recipe, force field, DEM, frames and studies.

Each check takes the configuration and the good rows of the slurry table, and yields a line for each problem.
"""

import itertools
import math
import shlex
import shutil
from collections.abc import Iterator, Mapping, Sequence

from slurrycast.analysis.rdf import MAX_SHARE_OF_EDGE
from slurrycast.config.derived_runs import dried_replicas, evaluated_replicas, timestep_runs
from slurrycast.config.formulations import all_phases, expected_density_g_cm3, of_recipe, of_slurry
from slurrycast.config.schema_errors import down, shown, up
from slurrycast.config.slurry_table import Slurry
from slurrycast.dem import forcefield, neighbour_lists, recipe

# Rows of the thermo table: three of them are in the last tenth, over which the drift of the density is fitted.
LEAST_THERMO_ROWS = 20
LEAST_RDF_BINS = 10  # below the longest distance that a box allows
LEAST_DAMPING_STEPS = 10  # of the thermostat, which would be no thermostat with fewer
# Steps in which the box collapses while no particle resists: with fewer the DEM ends in NaN or lost particles, or, with
# Berendsen's barostat, the box swings. NPT gives way as soon as particles do.
LEAST_COLLAPSE_STEPS = {"npt": 80, "berendsen": 500}
MOST_PARTICLES = 1_000_000  # of one slurry: nearly 30 times the published size, and 50 GB as the rules estimate it
SUM_TOLERANCE = 1e-6  # for fractions that sum to 1: room for thirds written with seven digits


def increasing(values: Sequence[float]) -> bool:
    """Whether values increase strictly."""
    return all(a < b for a, b in itertools.pairwise(values))


def commands(config: Mapping, _) -> Iterator[str]:
    """LAMMPS and the MPI launcher are a program, or one with its options."""
    for key in ("executable", "launcher"):
        command = config["dem"][key]
        try:
            if not shutil.which(command):  # a program with options, which the shell's rules separate
                shlex.split(command)
        except ValueError as error:  # an open quote, or a character that no path has
            yield f"dem.{key} = {shown(command)}: {str(error).lower()}: must be a program, or one with its options"


def recipe_names(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """Each slurry names a recipe that there is."""
    names = list(config["formulations"])
    for slurry in slurries:
        if slurry.formulation not in ("", *names):
            place = f"{config['slurries']}: slurry {slurry.id}: formulation = {shown(slurry.formulation)}"
            may_be = f"one of {', '.join(names)}, or empty" if names else "empty, as formulations has no recipe"
            yield f"{place}: must be {may_be}"


def fractions(config: Mapping, _) -> Iterator[str]:
    """Mass fractions and number fractions sum to 1."""
    phases = config["formulation"]["phases"]
    sums = {"formulation.phases: mass": math.fsum(phase["mass_fraction"] for phase in phases.values())}
    for name, phase in phases.items():
        numbers = [size_class["number_fraction"] for size_class in phase["size_classes"]]
        sums[f"formulation.phases.{name}.size_classes: number"] = math.fsum(numbers)
    for what, total in sums.items():
        if abs(total - 1) > SUM_TOLERANCE:
            yield f"{what} fractions sum to {total:.8g}: must be 1 within {SUM_TOLERANCE:g}"


def packing(config: Mapping, _) -> Iterator[str]:
    """The expected density leaves space between the particles, and the box has to shrink to reach it."""
    formulation = config["formulation"]
    expected, start = expected_density_g_cm3(formulation), formulation["initial_packing_fraction"]
    # specific volumes add up: the share of the final box that the particles fill
    final = expected * sum(p["mass_fraction"] / p["density_g_cm3"] for p in formulation["phases"].values())
    if final >= 1:
        yield (
            f"formulation.expected_density_g_cm3 = {shown(expected)}: must be below {down(expected / final)}, "
            "the density of the particles without space between them"
        )
    if start >= final:
        yield (
            f"formulation.initial_packing_fraction = {shown(start)}: must be below {down(final)}, the packing fraction "
            "at formulation.expected_density_g_cm3, since the box shrinks"
        )


def and_more(count: int) -> str:
    """The end of a line that stands for `count` slurries."""
    return f" (and {count - 1} more slurries)" if count > 1 else ""


def particles_per_pg(types: Sequence[recipe.ParticleType]) -> list[float]:
    """Number of particles of each type in 1 pg of slurry, not whole."""
    mean_mass_pg = dict.fromkeys((t.phase for t in types), 0.0)
    for t in types:
        mean_mass_pg[t.phase] += t.number_fraction * t.mass_pg
    return [t.mass_fraction * t.number_fraction / mean_mass_pg[t.phase] for t in types]


def whole_particles(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """Each slurry has at least one particle of each size class, and not too many."""
    types = recipe.particle_types(config["formulation"]["phases"])
    lacking, crowded = [], []
    for slurry in slurries:
        mass_pg = slurry.mass_units * config["formulation"]["unit_mass_pg"]
        particles = mass_pg * sum(particles_per_pg(types))
        if particles > MOST_PARTICLES:
            crowded.append((particles, slurry.id))
            continue
        counts = recipe.particle_counts(types, mass_pg)
        absent = [f"{t.phase} {t.diameter_um:g} um" for t, count in zip(types, counts, strict=True) if count == 0]
        if absent:
            lacking.append((mass_pg, slurry.id, ", ".join(absent)))
    if lacking:
        mass_pg, slurry_id, absent = min(lacking)
        yield (
            f"formulation.unit_mass_pg: slurry {slurry_id} of {mass_pg:.6g} pg has no particle of {absent}: must be "
            f"enough mass for one of each size class{and_more(len(lacking))}"
        )
    if crowded:
        particles, slurry_id = max(crowded)
        yield (
            f"formulation.unit_mass_pg: slurry {slurry_id} has {particles:.4g} particles: must be at most "
            f"{MOST_PARTICLES}{and_more(len(crowded))}"
        )


def shortest_edges(config: Mapping, slurries: Sequence[Slurry]) -> list[tuple[float, str]]:
    """Shortest edge in um that the box of each slurry is expected to end with, and the slurry's id."""
    formulation = config["formulation"]
    pg_per_unit_um3 = formulation["unit_mass_pg"] / expected_density_g_cm3(formulation)
    return [
        (min(recipe.box_edges_um(slurry.mass_units * pg_per_unit_um3, slurry.thickness_ratio)), slurry.id)
        for slurry in slurries
    ]


def mean_diameter_um(config: Mapping) -> float:
    """Mean diameter in um over the particles of the recipe, each of which counts as one."""
    types = recipe.particle_types(config["formulation"]["phases"])
    shares = particles_per_pg(types)
    return sum(share * t.diameter_um for share, t in zip(shares, types, strict=True)) / sum(shares)


def box_edges(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """No particle interacts with two periodic images of another one."""
    types = recipe.particle_types(config["formulation"]["phases"])
    skin_um = neighbour_lists.skin_um(config["dem"], types)
    cutoff_um = forcefield.largest_cutoff_um(types, config["force_field"]["lennard_jones"])
    least_um = 2 * (cutoff_um + skin_um)
    narrow = [(edge_um, slurry_id) for edge_um, slurry_id in shortest_edges(config, slurries) if edge_um <= least_um]
    if narrow:
        edge_um, slurry_id = min(narrow)
        yield (
            f"formulation.unit_mass_pg: slurry {slurry_id} ends with a shortest edge of {edge_um:.4g} um: must be "
            f"above {up(least_um)} um, twice the largest cutoff {cutoff_um:.4g} (cutoff_factor) and the skin "
            f"{skin_um:.4g}{and_more(len(narrow))}"
        )


def attraction(config: Mapping, _) -> Iterator[str]:
    """The cutoff lies outside the range of repulsion."""
    lennard_jones = config["force_field"]["lennard_jones"]
    sigma, cutoff = lennard_jones["sigma_factor"], lennard_jones["cutoff_factor"]
    if sigma >= cutoff:
        yield f"force_field.lennard_jones.sigma_factor = {shown(sigma)}: must be below cutoff_factor = {shown(cutoff)}"


def pairs(config: Mapping, _) -> Iterator[str]:
    """Each pair with forces of its own is one of phases that exist, in any recipe, and is named once."""
    phases, said = all_phases(config), set()
    for name in ("", *config["formulations"]):
        named = of_recipe(config, name)["force_field"]["pairs"]
        for pair in named:
            phase, other = pair.split("-")
            line = f"force_field.pairs.{pair}: must be "
            if not {phase, other} <= set(phases):
                line += f"two phases of {', '.join(phases)} with a hyphen between them"
            elif phase < other and f"{other}-{phase}" in named:
                line += f"given once, and is as {other}-{phase} too"
            else:
                continue
            if line not in said:
                yield f"formulations.{name}: {line}" if name else line
            said.add(line)


def long_timestep(
    key: str, timestep_us: float, dem: Mapping, types: Sequence[recipe.ParticleType], force_field: Mapping
) -> Iterator[str]:
    """Yield a line if a time step is too large a part of the Rayleigh or the Hertz time.

    It gives the stricter of the two bounds, with two digits: the study of time steps has to divide the times of the
    rows of the log, which more digits do not allow.

    Parameters
    ----------
    key, timestep_us
        The time step.
    dem
        Section dem, which holds the bounds.
    types, force_field
        All particle types, and the forces between them.
    """
    rayleigh_us = forcefield.rayleigh_times_us(types, force_field)
    hertz_us = forcefield.hertz_times_us(types, force_field, dem["impact_speed_um_us"])
    most_us, name, time_us, found = min(
        (dem[f"max_{name}_share"] * time_us, name, time_us, particles)
        for name, times in (("rayleigh", rayleigh_us), ("hertz", hertz_us))
        for particles, time_us in times.items()
    )
    if timestep_us > most_us:
        of = " and ".join(dict.fromkeys(f"{types[k].phase} of {types[k].diameter_um:.3g} um" for k in found))
        yield (
            f"{key} = {shown(timestep_us)}: {timestep_us / time_us:.3g} of the {name.capitalize()} time {time_us:.4g} "
            f"us of {of}: must be at most {down(most_us, 2)}, as dem.max_{name}_share = "
            f"{shown(dem[f'max_{name}_share'])}"
        )


def timestep(config: Mapping, _) -> Iterator[str]:
    """The time step resolves the Rayleigh wave and the Hertzian contact."""
    types = recipe.particle_types(config["formulation"]["phases"])
    yield from long_timestep(
        "dem.timestep_us", config["dem"]["timestep_us"], config["dem"], types, config["force_field"]
    )


def barostat(config: Mapping, _) -> Iterator[str]:
    """The box collapses neither in a few steps nor later than the run ends."""
    dem, formulation = config["dem"], config["formulation"]
    name, damping_us = dem["barostat"], dem["pressure_damping_us"]
    per_damping = 1.0
    if name == "npt":
        # The strain accelerates by pressure x volume over the barostat's mass, N k T damping^2.
        types = recipe.particle_types(formulation["phases"])
        volume_um3 = recipe.mean_volume_um3(types, particles_per_pg(types)) / formulation["initial_packing_fraction"]
        per_damping = math.sqrt(forcefield.thermal_share(dem["temperature_k"], dem["pressure_kpa"], volume_um3))
    least_us = LEAST_COLLAPSE_STEPS[name] * dem["timestep_us"] / per_damping
    most_us = dem["steps"] * dem["timestep_us"] / per_damping
    if not least_us <= damping_us <= most_us:
        yield (
            f"dem.pressure_damping_us = {shown(damping_us)}: the box would collapse in {damping_us * per_damping:.4g} "
            f"us: must be at least {up(least_us)} and at most {down(most_us)} with dem.barostat = {shown(name)}, these "
            "particles, temperature and steps"
        )


def thermostat(config: Mapping, _) -> Iterator[str]:
    """The thermostat has several time steps to act in."""
    damping_us, least_us = config["dem"]["temperature_damping_us"], LEAST_DAMPING_STEPS * config["dem"]["timestep_us"]
    if damping_us < least_us:
        yield (
            f"dem.temperature_damping_us = {shown(damping_us)}: must be at least {up(least_us)}, {LEAST_DAMPING_STEPS} "
            "time steps"
        )


def steps(config: Mapping, _) -> Iterator[str]:
    """Frames, thermo rows and segments fall on whole steps."""
    dem = config["dem"]
    n_steps, intervals, thermo = dem["steps"], dem["frames"] - 1, dem["thermo_every_steps"]
    if n_steps % intervals:
        yield f"dem.steps = {n_steps}: must be a multiple of dem.frames - 1 = {intervals}"
    elif (n_steps // intervals) % thermo:
        yield f"dem.thermo_every_steps = {thermo}: must divide the {n_steps // intervals} steps between two frames"
    elif n_steps // thermo < LEAST_THERMO_ROWS:
        yield (
            f"dem.thermo_every_steps = {thermo}: must be at most {n_steps // LEAST_THERMO_ROWS}, a "
            f"{LEAST_THERMO_ROWS}th of dem.steps, to tell whether the density is at rest"
        )
    if dem["segment_frames"] > intervals:
        yield f"dem.segment_frames = {dem['segment_frames']}: must be at most dem.frames - 1 = {intervals}"


def frames(config: Mapping, _) -> Iterator[str]:
    """Input frames increase, and the target frame is after them and inside the run."""
    last = config["dem"]["frames"] - 1
    inputs, target = config["learning"]["input_frames"], config["learning"]["target_frame"]
    if not increasing(inputs):
        yield f"learning.input_frames = {shown(inputs)}: must be strictly increasing"
    if not max(inputs) < target <= last:
        yield (
            f"learning.target_frame = {target}: must be after the last input frame {max(inputs)} and at most "
            f"dem.frames - 1 = {last}"
        )


def derived_ids(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """No slurry has the id of a run that follows from another one."""
    ids = {slurry.id for slurry in slurries}
    makers = {
        "evaluation.replicated": evaluated_replicas,
        "drying.replicas": dried_replicas,
        "convergence.slurry": timestep_runs,
    }
    runs: dict[str, str] = {}
    for key, make in makers.items():
        for run in make(config, slurries):
            runs.setdefault(run.id, key)
    for run_id, key in runs.items():
        if run_id in ids:
            yield f"{key}: its run {run_id} is named like a slurry of the table: rename that slurry"


def convergence(config: Mapping, _) -> Iterator[str]:
    """Time steps of the study have whole picoseconds, for their names, and keep the times of thermo rows."""
    steps_us, dem = config["convergence"]["timesteps_us"], config["dem"]
    wrong = [step for step in steps_us if abs(step * 1e6 - round(step * 1e6)) > 1e-6 or step < 1e-6]
    if wrong or not increasing(steps_us):
        yield f"convergence.timesteps_us = {shown(steps_us)}: must be whole picoseconds (1.0e-6), increasing"
        return
    interval_us = dem["timestep_us"] * dem["thermo_every_steps"]
    for step in steps_us:
        if abs(interval_us / step - round(interval_us / step)) > 1e-6:
            yield (
                f"convergence.timesteps_us: {shown(step)}: must divide dem.timestep_us x dem.thermo_every_steps = "
                f"{interval_us:.6g} us"
            )


def rdf_pair(config: Mapping, _) -> Iterator[str]:
    """The phases of the RDF exist, in one of the recipes."""
    pair, phases = config["analysis"]["rdf_pair"], all_phases(config)
    if not set(pair) <= set(phases):
        yield f"analysis.rdf_pair = {shown(pair)}: must be two phases of {', '.join(phases)}, which may be the same"


def phase_counts(config: Mapping, slurry: Slurry) -> dict[str, int]:
    """Number of particles of each phase of all recipes in a slurry."""
    formulation = of_slurry(config, slurry)["formulation"]
    types = recipe.particle_types(formulation["phases"])
    counts = recipe.particle_counts(types, slurry.mass_units * formulation["unit_mass_pg"])
    phases = all_phases(config)
    return {phase: sum(int(n) for t, n in zip(types, counts, strict=True) if t.phase == phase) for phase in phases}


def rdf_range(config: Mapping, _) -> Iterator[str]:
    """The RDF goes beyond the contacts of the largest particles."""
    cutoff_um = config["analysis"]["rdf_cutoff_um"]
    largest_um = max(kind.diameter_um for kind in recipe.particle_types(config["formulation"]["phases"]))
    if cutoff_um < 2 * largest_um:
        least_um = up(2 * largest_um)
        yield f"analysis.rdf_cutoff_um = {shown(cutoff_um)}: must be at least {least_um}, twice the largest diameter"


def rdf_bins(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """Enough bins of the RDF fit into each box that is predicted to tell a curve."""
    analysis = config["analysis"]
    width_um = analysis["rdf_cutoff_um"] / analysis["rdf_bins"]
    edges = shortest_edges(config, [slurry for slurry in slurries if slurry.role != "train"])
    edge_um, slurry_id = min(edges, default=(math.inf, ""))
    if MAX_SHARE_OF_EDGE * edge_um < LEAST_RDF_BINS * width_um:
        most_um = down(MAX_SHARE_OF_EDGE * edge_um / LEAST_RDF_BINS)
        yield (
            f"analysis.rdf_cutoff_um / analysis.rdf_bins = {width_um:.4g} um: must be at most {most_um}, for "
            f"{LEAST_RDF_BINS} bins in slurry {slurry_id}"
        )


def rdf_particles(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """Each slurry that is predicted has two particles for the RDF of a phase with itself."""
    pair = config["analysis"]["rdf_pair"]
    phase = pair[0]
    predicted = [slurry for slurry in slurries if slurry.role != "train"]
    if pair == [phase, phase] and phase in config["formulation"]["phases"]:
        alone = [slurry.id for slurry in predicted if phase_counts(config, slurry)[phase] == 1]
        if alone:
            yield (
                f"analysis.rdf_pair = {shown(pair)}: slurry {alone[0]} has 1 particle of {phase}: must be a phase with "
                f"at least 2{and_more(len(alone))}"
            )


def replicated_pairs(config: Mapping, replicated: Sequence[Slurry], compared: Sequence[Slurry]) -> Iterator[str]:
    """What is measured between particles of two phases in a compared slurry is so in one replicated slurry too."""

    def pairs(slurry: Slurry) -> dict[str, int]:
        """Number of pairs of particles of each pair of phases, each pair of one phase twice."""
        counts = phase_counts(config, slurry)
        both = itertools.combinations_with_replacement(counts, 2)
        return {f"{a}-{b}": counts[a] * (counts[b] - (a == b)) for a, b in both}

    known = {pair for slurry in replicated for pair, number in pairs(slurry).items() if number}
    missing: dict[str, str] = {}
    for slurry in compared:
        for pair, number in pairs(slurry).items():
            if number and pair not in known:
                missing.setdefault(pair, slurry.id)
    for pair, slurry_id in missing.items():
        yield (
            f"evaluation.replicated = {shown([slurry.id for slurry in replicated])}: no pair of particles {pair}: must "
            f"hold a slurry with one, as slurry {slurry_id} has,"
        )
