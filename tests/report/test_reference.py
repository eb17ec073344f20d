"""Settings that the configurations choose, against the reference runs that are the reason."""

import numpy as np
import pandas as pd
import yaml

from slurrycast.dem.equilibrium import equilibrium
from slurrycast.dem.recipe import particle_counts, particle_types


def test_time_step_of_the_demo(root):
    summary = pd.read_csv(root / "results" / "reference" / "timestep" / "timestep_summary.csv").set_index("timestep_us")
    coarse, fine = summary.loc[2e-3], summary.iloc[0]
    assert coarse.accepted == "yes"
    for quantity in ("coordination_all", "overlap_mean"):
        scatter = np.hypot(coarse[f"{quantity}_sd"], fine[f"{quantity}_sd"])
        assert abs(coarse[f"{quantity}_mean"] - fine[f"{quantity}_mean"]) < scatter


def test_relaxation(root):
    runs = pd.read_csv(root / "results" / "reference" / "relaxation" / "relaxation.csv").query("scale == 'demo'")
    config = yaml.safe_load((root / "config" / "config.yaml").read_text())["relaxation"]
    chosen = runs[
        (runs.start_temperature_k == config["start_temperature_k"])
        & (runs.pressure_damping_us == config["pressure_damping_us"])
        & (runs.steps == config["steps"])
    ].density_error
    cold = runs[(runs.start_temperature_k == 300) & (runs.steps == 20000)].density_error
    assert len(chosen), "results/reference/relaxation/relaxation.csv has no run with the settings of config.yaml"
    assert chosen.abs().max() < 0.005
    assert cold.abs().min() > chosen.abs().max()  # though in many more steps


def test_relaxation_steps_of_some_surrogates(root):
    runs = pd.read_csv(root / "results" / "reference" / "relaxation" / "steps.csv")
    default = yaml.safe_load((root / "config" / "config.yaml").read_text())["relaxation"]
    config = yaml.safe_load((root / "config" / "small.yaml").read_text())
    own = config["relaxation"]["steps_of"]
    seen = pd.read_csv(root / config["slurries"], sep="\t").query("role in ('train', 'test')").id
    assert not set(runs.slurry) & set(seen)
    same = (runs.start_temperature_k == default["start_temperature_k"]) & (
        runs.pressure_damping_us == default["pressure_damping_us"]
    )
    errors = runs[same].pivot_table(index="slurry", columns=["surrogate", "steps"], values="density_error")
    assert len(errors) == 10
    labels = [("neighbours", "neighbours"), ("driven_dem", "driven_dem"), ("driven_dem", "driven_dem_f24")]
    assert set(own) == {name for name, _ in labels}
    shorter, longer = ([errors[label, steps] for _, label in labels] for steps in (own["neighbours"], default["steps"]))
    assert set(own.values()) == {own["neighbours"]}
    for short, long in zip(shorter, longer, strict=True):
        assert short.notna().all() and long.notna().all() and abs(short.mean()) < abs(long.mean())
    affine = errors["affine", default["steps"]]
    assert affine.notna().all() and abs(affine.mean()) < min(abs(error.mean()) for error in longer)


def test_barostat_of_the_larger_scales(root):
    runs = {
        scale: pd.read_csv(root / "results" / "reference" / "densification" / f"{scale}_6.csv")
        for scale in ("demo", "reduced")
    }
    config = yaml.safe_load((root / "config" / "config.yaml").read_text())
    types = particle_types(config["formulation"]["phases"])
    counts, dense_us = {}, {}
    for scale in ("demo", "reduced", "full"):
        name = "config" if scale == "demo" else scale
        unit_pg = yaml.safe_load((root / "config" / f"{name}.yaml").read_text())["formulation"]["unit_mass_pg"]
        counts[scale] = int(particle_counts(types, 5 * unit_pg).sum())
    for scale, run in runs.items():
        dense_us[scale] = run.time_us[run.density_g_cm3 >= 2.0].iloc[0]
    ratio = {key: np.log(values["reduced"] / values["demo"]) for key, values in (("n", counts), ("t", dense_us))}
    exponent = ratio["t"] / ratio["n"]
    expected_us = dense_us["reduced"] * (counts["full"] / counts["reduced"]) ** exponent
    dem = {
        name: yaml.safe_load((root / "config" / f"{name}.yaml").read_text()).get("dem", {})
        for name in ("full", "reduced")
    }
    found = equilibrium(runs["reduced"].time_us.to_numpy(), runs["reduced"].density_g_cm3.to_numpy())
    run_us = {
        name: (config["dem"] | settings)["steps"] * (config["dem"] | settings)["timestep_us"]
        for name, settings in dem.items()
    }
    assert expected_us < run_us["full"]
    assert found.time_to_equilibrium_us < run_us["reduced"]
