"""The timestep study on made-up runs whose answer is known, from their files to tables and figure."""

import json

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from compare_timesteps import QUANTITIES
from configurations import load
from script_runs import run_script
from slurrycast.data.tables import read_table

# timestep (us), seed, density (g/cm3), height of the RDF's peak
RUNS = [
    (2e-3, 1, 2.27, 1.5),
    (1e-4, 2, 2.25, 1.2),
    (1e-3, 1, 2.245, 1.1),
    (1e-4, 1, 2.23, 1.0),
    (2e-3, 2, 2.26, 1.5),
    (1e-3, 2, 2.245, 1.1),
    (1e-4, 3, 2.24, 1.1),
]
OVERLAPS = {
    **{(1e-4, 1): 0.0074, (1e-4, 2): 0.0076, (1e-4, 3): 0.0075},
    **{(1e-3, 1): 0.00825, (1e-3, 2): 0.00825},
    **{(2e-3, 1): 0.00895, (2e-3, 2): 0.00905},
}
BINS = 40


@pytest.fixture
def study(tmp_path):
    """Options of compare_timesteps.py for the made-up runs, whose files are written."""
    config = load("config")
    options = {name: [] for name in ("run_json", "thermo", "structure", "rdf")}
    for timestep_us, seed, density_g_cm3, peak in RUNS:
        stem = f"V1_dt{round(timestep_us * 1e6)}ps_s{seed}"
        paths = {name: tmp_path / f"{stem}_{name}.csv" for name in options}
        run = {
            "slurry": stem,
            "physics": {
                "formulation": config["formulation"],
                "force_field": config["force_field"],
                "dem": config["dem"] | {"timestep_us": timestep_us},
                "slurry": {"mass_units": 1.0, "thickness_ratio": 1.5, "seed": seed},
            },
            "start": {"cpu_s": 1.0},
            "segments": [{"cpu_s": 2e-3 / timestep_us}, {"cpu_s": 3.0}],
        }
        paths["run_json"].write_text(json.dumps(run))
        time_us = np.arange(0, 121.0)
        # within 0.1 % of the end from 57 us on
        density_g_cm3_of_time = density_g_cm3 * (1 - 0.5 * np.exp(-(time_us + 5.2) / 10))
        thermo = pd.DataFrame({"time_us": time_us, "density_g_cm3": density_g_cm3_of_time})
        thermo.to_csv(paths["thermo"], index=False)
        quantities = {"particles": 600, "density_g_cm3": density_g_cm3, "coordination_all": 6.5, "overlap_max": 0.03}
        quantities["overlap_mean"] = OVERLAPS[timestep_us, seed]
        structure = pd.DataFrame({"quantity": quantities.keys(), "value": quantities.values()})
        structure.assign(surrogate="-", slurry=stem, stage="target").to_csv(paths["structure"], index=False)
        bins = BINS + (seed == 2)  # the range of a curve is that of its own box
        r_um = (np.arange(bins) + 0.5) * 0.05
        curves = [pd.DataFrame({"pair": pair, "r_um": r_um, "g": g}) for pair, g in (("all", peak), ("NiO-8YSZ", 9))]
        pd.concat(curves).assign(surrogate="-", slurry=stem, stage="target").to_csv(paths["rdf"], index=False)
        for name, path in paths.items():
            options[name].append(path)
    outputs = {"runs": tmp_path / "timestep.csv", "summary": tmp_path / "timestep_summary.csv"}
    return {**options, "max_density_difference": 0.005, **outputs}


def compared(study: dict) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Both tables: of the runs by timestep and seed, and of the timesteps."""
    done = run_script("compare_timesteps", **study)
    assert done.returncode == 0, done.stderr
    runs, summary = (read_table(study[name]) for name in ("runs", "summary"))
    return runs.set_index(["timestep_us", "seed"]), summary.set_index("timestep_us")


@pytest.fixture
def tables(study):
    return compared(study)


def test_runs(tables):
    runs, _ = tables
    assert runs.index.to_list() == sorted((timestep_us, seed) for timestep_us, seed, *_ in RUNS)
    row = runs.loc[(2e-3, 1)]
    assert row.slurry == "V1_dt2000ps_s1"
    assert (row.density_g_cm3, row.coordination_all, row.overlap_mean, row.overlap_max) == (2.27, 6.5, 0.00895, 0.03)
    assert row.rayleigh_share == pytest.approx(20 * runs.loc[(1e-4, 1)].rayleigh_share)
    assert row.rayleigh_share == pytest.approx(0.38, abs=0.01)
    np.testing.assert_allclose(runs.time_to_equilibrium_us, 57)
    assert (row.cpu_s, runs.loc[(1e-4, 1)].cpu_s) == (5, 24)


def test_rdf_difference_is_that_from_other_seeds_at_the_smallest_timestep(tables):
    runs, _ = tables
    assert runs.rdf_difference.to_dict() == pytest.approx(
        {
            (1e-4, 1): 0.15,  # from 1.1 and 1.2
            (1e-4, 2): 0.15,  # from 1.0 and 1.1
            (1e-4, 3): 0.10,  # from 1.0 and 1.2
            (1e-3, 1): 0.05,  # of 1.1 from 1.1 and 1.2, that of its own seed left out
            (1e-3, 2): 0.05,
            (2e-3, 1): 0.35,
            (2e-3, 2): 0.45,
        },
        abs=1e-9,
    )


def test_summary(tables):
    _, summary = tables
    assert summary.index.to_list() == [1e-4, 1e-3, 2e-3]
    assert summary.runs.to_list() == [3, 2, 2]
    np.testing.assert_allclose(summary.density_g_cm3_mean, [2.24, 2.245, 2.265])
    np.testing.assert_allclose(summary.density_g_cm3_sd, [0.01, 0, 0.01 / np.sqrt(2)], atol=1e-12)
    np.testing.assert_allclose(summary.density_difference, [0, 0.005 / 2.24, 0.025 / 2.24], atol=1e-8)
    # of the difference of two means: sqrt(sd1^2 / n1 + sd2^2 / n2)
    errors = [0, np.sqrt(1e-4 / 3), np.sqrt(1e-4 / 3 + 0.5e-4 / 2)]
    np.testing.assert_allclose(summary.standard_error, np.array(errors) / 2.24, rtol=1e-7)
    assert summary.accepted.to_list() == ["yes", "yes", "no"]
    bounds = summary.density_difference.abs() + 2 * summary.standard_error
    np.testing.assert_allclose(summary.density_difference_bound, bounds, rtol=1e-7)
    np.testing.assert_allclose(summary.coordination_all_difference, 0, atol=1e-12)
    np.testing.assert_allclose(summary.overlap_mean_difference, [0, 0.1, 0.2], rtol=1e-6)
    errors = 5e-5 * np.array([0, np.sqrt(4 / 3), np.sqrt(4 / 3 + 1)]) / 0.0075
    np.testing.assert_allclose(summary.overlap_mean_standard_error, errors, rtol=1e-6)
    columns = {f"{quantity}_{of}" for quantity in QUANTITIES for of in ("mean", "sd")}
    compared = ("coordination_all", "overlap_mean", "time_to_equilibrium_us")
    columns |= {f"{quantity}_{of}" for quantity in compared for of in ("difference", "standard_error")}
    assert columns < set(summary.columns)


def test_one_seed_gives_no_spread(study):
    for name in ("run_json", "thermo", "structure", "rdf"):
        study[name] = [study[name][i] for i in (3, 2)]
    runs, summary = compared(study)
    assert summary.density_g_cm3_sd.isna().all()
    assert summary.standard_error.isna().to_list() == [False, True]
    assert summary.accepted.to_list() == ["yes", "no"]  # 2.245 is 0.67 % above 2.23
    assert summary.density_difference_bound.isna().to_list() == [False, True]
    assert runs.rdf_difference.isna().all()


def test_differences_need_no_overlaps(study):
    for path in study["structure"]:
        structure = read_table(path)
        structure.assign(value=structure.value.mask(structure.quantity == "overlap_mean", 0)).to_csv(path, index=False)
    assert compared(study)[1].overlap_mean_difference.isna().all()


def test_the_summary_line_says_what_is_resolved(study):
    small, large = run_script("compare_timesteps", **study).stdout.splitlines()
    # 0.22 % and 2 x 0.26 %: within the bound of 0.5 % on the mean, but not shown to be
    assert small.startswith(
        "0.001 us: density accepted: yes, the difference is below 0.74 % at 2 standard errors, so not shown to be "
        "within 0.5 %; differs from the smallest timestep in: overlap_mean +10.00 % +- 0.77 %; "
        "not resolved: density_g_cm3 +0.22 % +- 0.26 %, "
    )
    assert large.startswith("0.002 us: density accepted: no, the difference is below 1.80 % at 2 standard errors; ")
    assert "differs from the smallest timestep in: density_g_cm3 +1.12 % +- 0.34 %, overlap_mean +20.00 %" in large


def test_runs_of_different_slurries_are_refused(study):
    path = study["run_json"][1]
    run = json.loads(path.read_text())
    run["physics"]["slurry"]["mass_units"] = 2.0
    path.write_text(json.dumps(run))
    result = run_script("compare_timesteps", **study)
    assert result.returncode == 1
    assert result.stderr.startswith(f"error: {path}: ")
    assert "must differ in seed" in result.stderr
    assert not study["runs"].exists()


def test_figure(study, tables, root, tmp_path):
    done = run_script(
        "plot_timesteps",
        runs=study["runs"],
        summary=study["summary"],
        equilibrium=root / "results" / "reference" / "reduced" / "tables" / "equilibrium.csv",
        max_density_difference=0.005,
        figure=tmp_path / "timesteps.png",
    )
    assert done.returncode == 0, done.stderr
    with Image.open(tmp_path / "timesteps.png") as picture:
        assert min(picture.size) > 600
