"""Settings that the configurations choose, against the reference runs that are the reason."""

import numpy as np
import pandas as pd

from configurations import load, shipped
from reference_results import REFERENCE, relaxation_settings
from slurrycast.dem.equilibrium import equilibrium
from slurrycast.dem.recipe import particle_counts, particle_types


def test_time_step_of_the_demo():
    summary = pd.read_csv(REFERENCE / "timestep" / "timestep_summary.csv").set_index("timestep_us")
    coarse, fine = summary.loc[2e-3], summary.iloc[0]
    assert coarse.accepted == "yes"
    for quantity in ("coordination_all", "overlap_mean"):
        scatter = np.hypot(coarse[f"{quantity}_sd"], fine[f"{quantity}_sd"])
        assert abs(coarse[f"{quantity}_mean"] - fine[f"{quantity}_mean"]) < scatter


def test_relaxation():
    """With the settings of config.yaml both starts end within 2 replica sd of the DEM; without heat none does."""
    in_sd = relaxation_settings().drop(columns="lammps_cpu_s")
    chosen, cold = in_sd.xs("none", level="setting"), in_sd.xs(1.0e-7, level="value")
    assert set(chosen.index.get_level_values("start")) == {"direct", "affine"}
    assert chosen.abs().max(axis=None) < 2
    assert (cold.coordination_all < -2).all()
    default = load("config")["relaxation"]
    for _, setting, value, _ in in_sd.index:
        assert setting in ("none", "packing_fraction") or default[setting] != value


def test_barostat_of_the_larger_scales():
    folder = REFERENCE / "densification"
    runs = {scale: pd.read_csv(folder / f"{scale}_6.csv") for scale in ("demo", "reduced")}
    configurations = {
        "demo": load("config"),
        "reduced": shipped("reduced"),
        "published_dt1e-4": shipped("published_dt1e-4"),
    }
    counts, dense_us, run_us = {}, {}, {}
    for scale, config in configurations.items():
        types = particle_types(config["formulation"]["phases"])
        counts[scale] = int(particle_counts(types, 5 * config["formulation"]["unit_mass_pg"]).sum())
        run_us[scale] = config["dem"]["steps"] * config["dem"]["timestep_us"]
    for scale, run in runs.items():
        dense_us[scale] = run.time_us[run.density_g_cm3 >= 2.0].iloc[0]
    exponent = np.log(dense_us["reduced"] / dense_us["demo"]) / np.log(counts["reduced"] / counts["demo"])
    expected_us = dense_us["reduced"] * (counts["published_dt1e-4"] / counts["reduced"]) ** exponent
    found = equilibrium(runs["reduced"].time_us.to_numpy(), runs["reduced"].density_g_cm3.to_numpy())
    assert expected_us < run_us["published_dt1e-4"]
    assert found.time_to_equilibrium_us < run_us["reduced"]


def test_tortuosity_and_pore_sizes_depend_on_the_grid():
    """By how much docs/tape.md and the comment of LEAST_VOXELS say of one slurry."""
    from slurrycast.analysis.microstructure import microstructure, void_tortuosity
    from slurrycast.data.frames import read_frames

    with read_frames(REFERENCE / "reduced" / "frames" / "2.h5") as store:
        frame, particles = store.frame(store.last), store.particles
    found = [void_tortuosity(frame, particles, spacing_um) for spacing_um in (0.2, 0.1)]
    np.testing.assert_allclose(found, [4.85, 2.49], atol=0.005)
    images = [microstructure(frame, particles, "BDPD", 0.0, spacing_um) for spacing_um in (0.1, 0.2, 0.5)]
    pores_um = [sizes["mean"] for _, _, sizes in images]
    np.testing.assert_allclose(pores_um, [0.27, 0.33, 0.75], atol=0.005)


def test_trainings_on_another_recipe_are_the_best_of_those_tried():
    choices = pd.read_csv(REFERENCE / "transfer" / "choices.csv")
    networks = load("transfer")["transfer"]["networks"]
    for (surrogate, start), tried in choices.groupby(["surrogate", "start"]):
        best = tried.loc[tried.skill.idxmax()]
        assert networks[surrogate][start] == {"epochs": best.epochs, "learning_rate": best.learning_rate}
    assert set(choices.surrogate) == set(networks)
