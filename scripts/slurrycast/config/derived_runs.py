"""DEM runs that follow from rows of the slurry table, and the DEM settings that hold for one run."""

import dataclasses
from collections.abc import Mapping, Sequence

from slurrycast.config.formulations import of_slurry
from slurrycast.config.slurry_table import Slurry
from slurrycast.dem import neighbour_lists, recipe


def replicas(config: Mapping, slurries: Sequence[Slurry]) -> list[Slurry]:
    """All replicas, those of the evaluation and those that the main job dries, which may be the same."""
    runs = [*evaluated_replicas(config, slurries), *dried_replicas(config, slurries)]
    return list({run.id: run for run in runs}.values())


def evaluated_replicas(config: Mapping, slurries: Sequence[Slurry]) -> list[Slurry]:
    """The replicated slurries of the evaluation with other seeds: 6_r1, 6_r2, ... of slurry 6."""
    settings = config["evaluation"]
    replicated = [slurry for slurry in slurries if slurry.id in settings["replicated"]]
    return [run for slurry in replicated for run in _with_other_seeds(slurry, settings["replicas"])]


def dried_replicas(config: Mapping, slurries: Sequence[Slurry]) -> list[Slurry]:
    """Those of one small test slurry, where the DEM of test slurries is dried.

    It is the smallest one of `evaluation.replicated`, so that nothing runs twice, or of all where that names none.
    """
    test = [slurry for slurry in slurries if slurry.role == "test"]
    replicated = [slurry for slurry in test if slurry.id in config["evaluation"]["replicated"]]
    if "dem" not in config["drying"]["sources"] or not test:
        return []

    def mass_pg(slurry: Slurry) -> float:
        return slurry.mass_units * of_slurry(config, slurry)["formulation"]["unit_mass_pg"]

    smallest = min(replicated or test, key=mass_pg)
    return _with_other_seeds(smallest, config["drying"]["replicas"])


def _with_other_seeds(slurry: Slurry, number: int) -> list[Slurry]:
    return [
        dataclasses.replace(
            slurry, id=f"{slurry.id}_r{k}", role="replica", seed=recipe.derived_seed(slurry.seed, f"replica {k}")
        )
        for k in range(1, number + 1)
    ]


def timestep_runs(config: Mapping, slurries: Sequence[Slurry]) -> list[Slurry]:
    """The slurry of the convergence study with each time step and seed: V1_dt2000ps_s1, ...

    They last as long as the slurry itself and have their frames and thermo rows at the same times.
    """
    study, dem = config["convergence"], config["dem"]
    runs = []
    for slurry in slurries:
        for step_us in study["timesteps_us"] if slurry.id == study["slurry"] else []:
            finer = dem["timestep_us"] / step_us
            settings = {key: round(dem[key] * finer) for key in ("steps", "thermo_every_steps")}
            runs += [
                dataclasses.replace(
                    slurry,
                    id=f"{slurry.id}_dt{round(step_us * 1e6)}ps_s{k}",
                    role="timestep",
                    seed=recipe.derived_seed(slurry.seed, f"convergence {k}"),
                    dem={"timestep_us": step_us} | settings,
                )
                for k in range(1, study["seeds"] + 1)
            ]
    return runs


def dem_settings(config: Mapping, run: Slurry) -> dict:
    """The section `dem` as it holds for one run; a skin that follows from the recipe is worked out."""
    types = recipe.particle_types(config["formulation"]["phases"])
    return {**config["dem"], "skin_um": neighbour_lists.skin_um(config["dem"], types), **run.dem}
