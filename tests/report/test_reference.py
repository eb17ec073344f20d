"""Measured figures that the configurations give as reasons, against the runs that they come from."""

import re

import numpy as np
import pandas as pd
import pytest
import yaml

from slurrycast.dem.equilibrium import equilibrium
from slurrycast.dem.recipe import particle_counts, particle_types


@pytest.fixture
def comments(root):
    """All comments of a configuration as one text."""

    def read(scale: str) -> str:
        text = (root / "config" / f"{scale}.yaml").read_text(encoding="utf-8")
        return " ".join(re.findall(r"# (.*)", text))

    return read


def test_time_step_of_the_demo(root, comments):
    summary = pd.read_csv(root / "results" / "reference" / "timestep" / "timestep_summary.csv").set_index("timestep_us")
    coarse, fine = summary.loc[2e-3], summary.iloc[0]
    assert f"{coarse.density_difference:+.1%} from its density with {fine.name:.0e}".replace("e-04", "e-4") in comments(
        "config"
    )
    assert f"error {coarse.standard_error:.1%}," in comments("config")
    assert coarse.accepted == "yes"
    for quantity in ("coordination_all", "overlap_mean"):
        scatter = np.hypot(coarse[f"{quantity}_sd"], fine[f"{quantity}_sd"])
        assert abs(coarse[f"{quantity}_mean"] - fine[f"{quantity}_mean"]) < scatter


def test_relaxation(root, comments):
    runs = pd.read_csv(root / "results" / "reference" / "relaxation" / "relaxation.csv").query("scale == 'demo'")
    config = yaml.safe_load((root / "config" / "config.yaml").read_text())["relaxation"]
    chosen = runs[
        (runs.start_temperature_k == config["start_temperature_k"])
        & (runs.pressure_damping_us == config["pressure_damping_us"])
        & (runs.steps == config["steps"])
    ].density_error
    cold = runs[(runs.start_temperature_k == 300) & (runs.steps == 20000)].density_error
    assert f"{chosen.min():+.1%} to {chosen.max():+.1%} from the DEM's density" in comments("config")
    assert f"at a constant 300 K {cold.min():.1%} to {cold.max():.1%}" in comments("config")


def test_relaxation_steps_of_some_surrogates(root, comments):
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
    means = [f"{100 * error.mean():+.2f}%" for error in (*shorter, *longer)]
    affine = errors["affine", default["steps"]]
    assert affine.notna().all()
    text = comments("small")
    (first, second, third), (fourth, fifth, sixth) = means[:3], means[3:]
    assert f"mean density {first} (neighbours), {second} (driven_dem) and {third} (driven_dem_f24) from" in text
    assert f"with {default['steps']} steps {fourth}, {fifth} and {sixth}; and" in text
    assert f"the affine map at {100 * affine.mean():+.2f}% (" in text


def test_barostat_of_the_larger_scales(root, comments):
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
        said = f"{counts[scale]:,}".replace(",", " ")
        assert re.search(rf"{said} (particles reach 2.0 g/cm3 )?after {dense_us[scale]:g} us", comments("full"))
    ratio = {key: np.log(values["reduced"] / values["demo"]) for key, values in (("n", counts), ("t", dense_us))}
    exponent = ratio["t"] / ratio["n"]
    assert f"N^{exponent:.2f}" in comments("full")
    expected_us = dense_us["reduced"] * (counts["full"] / counts["reduced"]) ** exponent
    assert f"after about {expected_us:.0f} us" in comments("full")
    found = equilibrium(runs["reduced"].time_us.to_numpy(), runs["reduced"].density_g_cm3.to_numpy())
    assert f"from {found.time_to_equilibrium_us:g} us on" in comments("reduced")
