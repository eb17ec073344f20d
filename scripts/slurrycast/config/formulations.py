"""Recipes of one run: `formulation` is the default, `formulations` holds what differs from it in others, by name."""

from collections.abc import Mapping
from typing import Any

from slurrycast.config.composition import wet_composition
from slurrycast.config.slurry_table import Slurry

SECTIONS = ("force_field", "drying")  # what a recipe may change beside `formulation`
SOLVENT = ("composition_is", "solvent_mass_fraction", "solvent_fraction_of")  # what `wet_composition` changes of drying


# Share of the volume that particles fill in an equilibrated slurry: results/reference/reduced/packing_fraction.json.
EXPECTED_PACKING_FRACTION = 0.668


def expected_density_g_cm3(formulation: Mapping) -> float:
    """Density of the equilibrated slurry as the recipe expects it, else at `EXPECTED_PACKING_FRACTION`."""
    if (given := formulation["expected_density_g_cm3"]) is not None:
        return given
    phases = formulation["phases"].values()
    return EXPECTED_PACKING_FRACTION / sum(phase["mass_fraction"] / phase["density_g_cm3"] for phase in phases)


def merged(base: Any, changes: Any) -> Any:
    """`base` with the `changes`: mappings key by key, all else as a whole."""
    if not isinstance(base, Mapping) or not isinstance(changes, Mapping):
        return changes
    return {**base, **{key: merged(base[key], value) if key in base else value for key, value in changes.items()}}


def of_recipe(config: Mapping, name: str) -> dict:
    """The configuration as it holds for the recipe `name`, "" for the default. KeyError if there is none."""
    if not name:
        return dict(config)
    changes = config["formulations"][name]
    sections = {key: merged(config[key], changes[key]) for key in SECTIONS if key in changes}
    # phases as a whole, as a configuration replaces those of config.yaml
    expected = {"expected_density_g_cm3": None} if "phases" in changes else {}  # that of the default fits its phases
    changed = {key: value for key, value in changes.items() if key not in SECTIONS}
    formulation = {**config["formulation"], **expected, **changed}
    return {**config, **sections, "formulation": formulation}


def of_slurry(config: Mapping, slurry: Slurry) -> dict:
    """The configuration as it holds for a slurry: with `formulation`, `force_field` and `drying` of its recipe."""
    return of_recipe(config, slurry.formulation)


def wet_recipes(config: Mapping) -> dict:
    """The same configuration with the wet composition of every recipe, as `wet_composition` makes it of one.

    The phases of each recipe are `in_common_order`.
    """
    converted = {**wet_composition(config), "formulations": dict(config["formulations"])}
    for name, changes in config["formulations"].items():
        wet = wet_composition(of_recipe(config, name))
        taken = of_recipe(converted, name)  # what it takes from the default may have been written dry
        if any(wet[section] != taken[section] for section in ("formulation", "drying")):
            solvent = {key: wet["drying"][key] for key in SOLVENT}
            drying = {**changes.get("drying", {}), **solvent}
            formulation = {"expected_density_g_cm3": wet["formulation"]["expected_density_g_cm3"]}
            formulation["phases"] = wet["formulation"]["phases"]
            converted["formulations"][name] = {**changes, **formulation, "drying": drying}
    return in_common_order(converted)


def in_common_order(config: Mapping) -> dict:
    """The same configuration with the phases of each recipe in the order of `all_phases`, which names their pairs."""
    order, recipes = all_phases(config), dict(config["formulations"])
    for name, changes in recipes.items():
        if "phases" in changes:
            phases = {phase: changes["phases"][phase] for phase in order if phase in changes["phases"]}
            recipes[name] = {**changes, "phases": phases}
    return {**config, "formulations": recipes}


def all_phases(config: Mapping) -> list[str]:
    """Names of the phases of all recipes: those of the default in their order, then others as they appear."""
    recipes = [of_recipe(config, name)["formulation"] for name in ("", *config["formulations"])]
    return list(dict.fromkeys(phase for recipe in recipes for phase in recipe["phases"]))
