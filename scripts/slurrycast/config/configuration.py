"""Entry: checks a whole configuration and its slurry table before any job, and reports all problems at once.

The Snakefile imports this module when it is parsed, so its imports stay light. What the schemas in workflow/schemas say
is not repeated here; the checks below are those that a schema cannot express. Paths are relative to the working
directory, but a slurry table may also lie in the project.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from slurrycast.config import dem_checks, drying_checks, exploration, model_checks, surrogate_checks
from slurrycast.config.composition import wet_composition
from slurrycast.config.derived_runs import replicas, timestep_runs
from slurrycast.config.formulations import merged, of_recipe
from slurrycast.config.physics import changed_physics
from slurrycast.config.schema_errors import schema, schema_errors, with_text_keys
from slurrycast.config.slurry_table import Slurry, read_slurry_table
from slurrycast.runtime.command_line import printable
from slurrycast.runtime.files import InputError

# Each check with the keys that it reads: it is left out where the schema has found one of them wrong.
CHECKS: dict[Callable[[Mapping, Sequence[Slurry]], Iterator[str]], str] = {
    dem_checks.commands: "dem.executable dem.launcher",
    dem_checks.recipe_names: "slurries formulations",
    dem_checks.steps: "dem.steps dem.frames dem.thermo_every_steps dem.segment_frames",
    dem_checks.frames: "dem.frames learning.input_frames learning.target_frame",
    surrogate_checks.validation_share: "slurries formulation formulations learning",
    surrogate_checks.roles: "slurries surrogate.models surrogate.names surrogate.packing_fraction",
    surrogate_checks.labels: (
        "surrogate.names evaluation.surrogates report.pictures learning.input_frames learning.target_frame"
    ),
    surrogate_checks.result_paths: (
        "slurries surrogate.names evaluation drying convergence report.pictures dem.timestep_us dem.steps "
        "dem.thermo_every_steps"
    ),
    surrogate_checks.intermediate_targets: "surrogate.neighbours",
    surrogate_checks.early_dem: "surrogate.early_dem",
    model_checks.starts: "run surrogate evaluation.surrogates learning.input_frames formulation.phases formulations",
    surrogate_checks.models: "surrogate.names surrogate.models surrogate.packing_fraction evaluation.surrogates",
    surrogate_checks.models_of_this_run: "run surrogate.models",
    model_checks.models_of_other_training: (
        "slurries surrogate evaluation.surrogates learning.input_frames learning.target_frame formulation formulations "
        "force_field drying dem"
    ),
    surrogate_checks.packing_of_recipes: "slurries formulations surrogate evaluation.surrogates",
    model_checks.tuning: "slurries transfer surrogate.names evaluation.surrogates",
    dem_checks.convergence: "convergence.timesteps_us dem.timestep_us dem.thermo_every_steps",
    dem_checks.derived_ids: "slurries evaluation drying convergence dem.timestep_us dem.steps dem.thermo_every_steps",
    drying_checks.extrapolation: "microstructure",
    drying_checks.tortuosity_voxels: (
        "slurries formulation formulations force_field drying microstructure dem.skin_um"
    ),
    dem_checks.pairs: "formulation.phases formulations force_field drying",
    exploration.ranges: "explore.ranges formulation.phases",
    exploration.enough_points: "explore",
    exploration.properties: "explore formulation.phases drying.phase microstructure surrogate.names",
    dem_checks.rdf_pair: "formulation.phases formulations analysis.rdf_pair",
}
# The same for checks of one recipe: they take the configuration as it holds for it, and its slurries.
RECIPE_CHECKS: dict[Callable[[Mapping, Sequence[Slurry]], Iterator[str]], str] = {
    dem_checks.fractions: "formulation.phases",
    drying_checks.solvent: "formulation.phases drying",
    dem_checks.packing: "formulation.phases formulation.expected_density_g_cm3 formulation.initial_packing_fraction",
    dem_checks.whole_particles: "formulation.phases formulation.unit_mass_pg",
    dem_checks.box_edges: (
        "formulation.phases formulation.unit_mass_pg formulation.expected_density_g_cm3 "
        "force_field.lennard_jones.cutoff_factor dem.skin_um"
    ),
    dem_checks.attraction: "force_field.lennard_jones.sigma_factor force_field.lennard_jones.cutoff_factor",
    dem_checks.timestep: (
        "formulation.phases force_field dem.timestep_us dem.impact_speed_um_us "
        "dem.max_rayleigh_share dem.max_hertz_share"
    ),
    dem_checks.barostat: (
        "dem.barostat dem.pressure_damping_us dem.timestep_us dem.steps dem.temperature_k dem.pressure_kpa "
        "formulation.phases formulation.initial_packing_fraction"
    ),
    dem_checks.thermostat: "dem.temperature_damping_us dem.timestep_us",
    surrogate_checks.neighbours_cutoff: (
        "surrogate.names evaluation.surrogates surrogate.neighbours formulation.phases formulation.unit_mass_pg "
        "formulation.expected_density_g_cm3"
    ),
    drying_checks.drying: (
        "slurries formulation force_field drying microstructure dem.timestep_us dem.skin_um dem.impact_speed_um_us "
        "dem.max_rayleigh_share dem.max_hertz_share"
    ),
    dem_checks.rdf_range: "formulation.phases analysis.rdf_cutoff_um",
    dem_checks.rdf_bins: (
        "formulation.phases formulation.unit_mass_pg formulation.expected_density_g_cm3 analysis.rdf_cutoff_um "
        "analysis.rdf_bins"
    ),
    dem_checks.rdf_particles: "formulation.phases formulation.unit_mass_pg analysis.rdf_pair",
}


class ConfigurationError(InputError):
    """Every problem of a configuration or a slurry table; `lines` holds one line for each."""

    def __init__(self, lines: Sequence[str]):
        super().__init__("\n".join(lines))
        self.lines = list(lines)


def _problems(config: Mapping) -> tuple[list[Slurry], list[str]]:
    """The good rows of the slurry table, and a line for each problem."""
    lines: list[str] = []
    config = with_text_keys(config, "", lines)
    wrong = dict.fromkeys(schema_errors(config, schema("config")))
    # "=" between a key and its value, ":" between a key and a word on it
    lines += [f"{path}{': ' if what.startswith(('missing', 'unknown')) else ' = '}{what}" for path, what in wrong]
    bad = [re.split(r"[.\[]", path) for path, _ in wrong]

    def usable(keys: str) -> bool:
        """Whether no wrong key lies on the way to one of `keys` or below it."""
        wanted = [key.split(".") for key in keys.split()]
        return not any(all(a == b for a, b in zip(way, key, strict=False)) for way in bad for key in wanted)

    if ["configuration"] in bad:  # no mapping at all
        return [], lines
    slurries, table_lines = read_slurry_table(config["slurries"]) if usable("slurries") else ([], [])
    lines += table_lines
    if table_lines:
        bad.append(["slurries"])  # the good rows are checked below, but not whether a role is missing
    lines += [line for check, keys in CHECKS.items() if usable(keys) for line in check(config, slurries)]
    names = list(config["formulations"]) if usable("formulations") and usable("formulation force_field drying") else []
    of_default: list[str] = []
    for name in ["", *names]:
        recipe = of_recipe(config, name)
        if usable("formulation.phases drying"):
            recipe = wet_composition(recipe)
        of_it = [slurry for slurry in slurries if slurry.formulation == name]
        wrong = [line for check, keys in RECIPE_CHECKS.items() if usable(keys) for line in check(recipe, of_it)]
        lines += [f"formulations.{name}: {line}" if name else line for line in wrong if line not in of_default]
        of_default = of_default if name else wrong
    if usable("run formulation formulations slurries force_field drying dem evaluation convergence"):
        slurries_known = [slurry for slurry in slurries if slurry.formulation in ("", *names)]
        runs = [*slurries_known, *replicas(config, slurries_known), *timestep_runs(config, slurries_known)]
        lines += changed_physics(config, runs, Path("results") / config["run"]["name"])
    return slurries, [printable(line) for line in lines]


def check(config: Mapping) -> list[str]:
    """Check a whole configuration, its slurry table, and earlier DEM results under its name in results/.

    Returns a line for each problem (key path or file, value, what is allowed); none means that the workflow may start.
    """
    return _problems(config)[1]


def checked_slurries(config: Mapping) -> list[Slurry]:
    """The slurries of a configuration without problems; raises ConfigurationError with all lines of `check`."""
    slurries, lines = _problems(config)
    if lines:
        raise ConfigurationError(lines)
    return slurries


def checked_points(config: Mapping, slurries: Sequence[Slurry]) -> tuple[dict[str, exploration.Point], list[str]]:
    """The recipes of an exploration by id, or a line for each problem of its design, which can be written anew.

    Parameters
    ----------
    config, slurries
        A configuration without other problems, and its slurry table.

    Raises
    ------
    ConfigurationError
        If the user's own table of recipes has problems: its file, line, column or key, value and what is allowed.
    """
    points, lines = exploration.read_points(config, slurries)
    recipes = exploration.with_points(config, points)
    has_tortuosity = any(name.startswith("tortuosity_") for name in config["explore"]["properties"])
    dried = merged(recipes, {"drying": {"sources": ["direct"]}, "microstructure": {"tortuosity_slurries": 1}})
    for point in points:
        recipe = wet_composition(of_recipe(dried, point.slurry.id))  # all are dried
        wrong = [line for check_recipe in RECIPE_CHECKS for line in check_recipe(recipe, [point.slurry])]
        if has_tortuosity:
            wrong += drying_checks.tortuosity_voxels(dried, [point.slurry])
        # to dry nothing, or to measure no tortuosity, is no way out here
        wrong = [
            line.partition("; or set ")[0].replace("formulation.unit_mass_pg", "explore.particles") for line in wrong
        ]
        lines += [f"{point.place}: {line}" for line in wrong[:1]]
    if not lines:
        confirmed = [point.slurry for point in points if point.is_confirmed]
        lines = changed_physics(recipes, confirmed, Path("results") / config["run"]["name"])
    lines = [printable(line) for line in lines]
    if lines and config["explore"]["recipes"]:
        raise ConfigurationError(lines)
    return ({} if lines else {point.slurry.id: point for point in points}), lines


def in_order(config: Mapping, rule: Mapping | None = None) -> dict:
    """The same configuration with its keys in the order of the schema, at every level.

    Where two files are merged, the keys of the second one come first. Scripts take sections as text, and Snakemake
    repeats a job whose text has changed. The order of phases, which numbers them, stays.
    """
    rule = schema("config") if rule is None else rule
    known = rule.get("properties", {})
    (further,) = rule.get("patternProperties", {"": {}}).values()
    keys = [key for key in known if key in config] + [key for key in config if key not in known]

    def ordered(value: Any, value_rule: Mapping) -> Any:
        if isinstance(value, Mapping):
            return in_order(value, value_rule)
        return [ordered(item, value_rule.get("items", {})) for item in value] if isinstance(value, list) else value

    return {key: ordered(config[key], known.get(key, further)) for key in keys}
