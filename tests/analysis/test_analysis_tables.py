"""The scripts of the analysis, run on small made-up slurries."""

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from slurrycast.data.tables import read_table
from slurrycast.runtime.costs import Cost, read_cost
from slurrycast.runtime.files import write_text
from structures import frame, particles, write_store

PHASES = ("BDPD", "NiO", "8YSZ")
N = 150
EDGES_UM = np.array([6.0, 6.0, 12.0])
PARTICLES = particles(np.repeat([1, 2, 3], N // 3), names=PHASES)


def target_um(seed: int) -> np.ndarray:
    """Coordinates at the target frame, some of them outside the box."""
    return np.random.default_rng(seed).uniform(-0.7, 0.7, (N, 3)) * EDGES_UM


@pytest.fixture
def slurry(tmp_path):
    """Write DEM frames, a prediction 10 % too large on every axis, and an exact relaxed structure of one slurry."""

    def write(name: str, seed: int, last: int = 120) -> dict[str, Path]:
        paths = {key: tmp_path / f"{name}_{key}.h5" for key in ("frames", "predicted", "relaxed")}
        target = target_um(seed)
        frames = [frame(k, target * scale, EDGES_UM * scale) for k, scale in ((10, 1.5), (120, 1.0)) if k <= last]
        write_store(paths["frames"], frames, PARTICLES, slurry=name)
        origin = {"slurry": name, "surrogate": "vgg16"}
        write_store(paths["predicted"], [frame(120, 1.1 * target, 1.1 * EDGES_UM)], PARTICLES, **origin)
        write_store(paths["relaxed"], [frame(0, target, EDGES_UM)], PARTICLES, **origin)
        return paths

    return write


@pytest.fixture
def run(root, tmp_path):
    """Run a script, with --cost added where it has one; return the finished process."""

    def start(script: str, *arguments: object) -> subprocess.CompletedProcess:
        command = [sys.executable, *root.glob(f"scripts/*/{script}"), *arguments]
        if script != "collect_costs.py":
            command += ["--cost", tmp_path / "cost.json"]
        return subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=120)

    return start


def table(process: subprocess.CompletedProcess, path: Path) -> pd.DataFrame:
    """The table that a successful run wrote."""
    assert process.returncode == 0, process.stderr
    return read_table(path)


def test_coordinate_errors(slurry, run, tmp_path):
    a, b = slurry("1", 11), slurry("2", 12)
    out = tmp_path / "coordinate_errors.csv"
    arguments = ["--predicted", a["predicted"], b["predicted"], "--frames", a["frames"], b["frames"]]
    errors = table(run("compare_coordinates.py", *arguments, "--target-frame", 120, "--table", out), out)
    measures = ["mse_um2", "mae_um", "r2", "mse_um2_true_box", "mae_um_true_box", "r2_true_box"]
    assert list(errors.columns) == ["surrogate", "slurry", "axis", *measures]
    assert list(errors.slurry) == ["1"] * 4 + ["2"] * 4
    assert list(errors.axis) == ["x", "y", "z", "all"] * 2
    assert set(errors.surrogate) == {"vgg16"}
    # 10 % too large: R2 = 1 - 0.1^2 in its own box, exact in the true one.
    np.testing.assert_allclose(errors.r2, 1 - 0.1**2, rtol=1e-8)
    np.testing.assert_allclose(errors.mse_um2[:3], 0.01 * np.var(target_um(11), axis=0), rtol=1e-8)
    np.testing.assert_allclose(errors.mse_um2_true_box, 0, atol=1e-12)
    np.testing.assert_allclose(errors.r2_true_box, 1, atol=1e-12)
    assert read_cost(tmp_path / "cost.json").stage == "compare_coordinates"


def test_a_prediction_of_another_slurry_is_refused(slurry, run, tmp_path):
    a, b = slurry("1", 11), slurry("2", 12)
    out = tmp_path / "coordinate_errors.csv"
    arguments = ["--predicted", a["predicted"], "--frames", b["frames"], "--target-frame", 120, "--table", out]
    process = run("compare_coordinates.py", *arguments)
    assert process.returncode == 1
    assert process.stderr == f"error: {a['predicted']}: slurry 1, not the particles of {b['frames']}\n"
    assert not out.exists()


def rdf_arguments(paths: dict[str, Path], out: Path, pair: tuple[str, str] = ("NiO", "8YSZ")) -> list:
    """Arguments of compute_rdf.py but for the target frame."""
    stores = [part for key, path in paths.items() for part in (f"--{key}", path)]
    return [*stores, "--cutoff-um", 7, "--bins", 120, "--pair", *pair, "--rdf", out]


def test_rdf_and_its_differences(slurry, run, tmp_path):
    out = tmp_path / "1.csv"
    process = run("compute_rdf.py", *rdf_arguments(slurry("1", 11), out), "--target-frame", 120)
    curves = table(process, out)
    assert list(curves.columns) == ["surrogate", "slurry", "pair", "r_um", "g_dem", "g_predicted", "g_relaxed"]
    bins = int(0.49 * 6 / (7 / 120))  # the target's and the relaxed box have the shortest edge
    assert dict(curves.pair.value_counts()) == {"all": bins, "NiO-8YSZ": bins}
    np.testing.assert_allclose(np.diff(curves.r_um[:bins]), 7 / 120, rtol=1e-6)
    np.testing.assert_allclose(curves.g_relaxed, curves.g_dem)
    assert curves.g_predicted.between(0.5, 1.5)[bins - 20 : bins].all()
    cost = read_cost(tmp_path / "cost.json")
    assert (cost.stage, cost.surrogate, cost.slurry, cost.particles) == ("compute_rdf", "vgg16", "1", N)

    curves.g_relaxed += np.where(curves.pair == "all", 0.25, -0.5)
    write_text(out, curves.to_csv(index=False))
    errors = table(run("compare_rdf.py", "--rdf", out, "--table", tmp_path / "rdf.csv"), tmp_path / "rdf.csv")
    assert list(errors.columns) == ["surrogate", "slurry", "pair", "r_max_um", "bins", "mean_abs_difference"]
    assert list(errors.pair) == ["all", "NiO-8YSZ"]
    np.testing.assert_allclose(errors.mean_abs_difference, [0.25, 0.5])
    np.testing.assert_allclose(errors.r_max_um, bins * 7 / 120, rtol=1e-8)
    assert list(errors.bins) == [bins, bins]
    assert list(errors.slurry) == ["1", "1"]


def test_rdf_of_a_new_slurry_has_no_target(slurry, run, tmp_path):
    out = tmp_path / "N1.csv"
    curves = table(run("compute_rdf.py", *rdf_arguments(slurry("N1", 13, last=10), out, pair=("8YSZ", "NiO"))), out)
    assert list(curves.pair.unique()) == ["all", "8YSZ-NiO"]  # in any order
    assert curves.g_dem.isna().all()
    assert curves[["g_predicted", "g_relaxed"]].notna().all(axis=None)
    process = run("compare_rdf.py", "--rdf", out, "--table", tmp_path / "rdf.csv")
    assert process.returncode == 1
    assert process.stderr == f"error: {out}: g_dem is empty, only slurries with a target can be compared\n"


def test_an_unknown_phase_is_refused(slurry, run, tmp_path):
    process = run("compute_rdf.py", *rdf_arguments(slurry("1", 11), tmp_path / "1.csv", pair=("NiO", "8ysz")))
    assert process.returncode == 1
    assert process.stderr == "error: --pair 8ysz: no such particles, phases are BDPD, NiO, 8YSZ\n"


def test_density_and_volume(slurry, run, tmp_path):
    a, b = slurry("1", 11), slurry("T1", 12)
    out = tmp_path / "density_volume.csv"
    arguments = ["--frames", b["frames"], a["frames"], "--relaxed", a["predicted"], "--target-frame", 120]
    rows = table(run("measure_density.py", *arguments, "--table", out), out)
    volume_um3 = 6 * 6 * 12
    assert list(rows.surrogate) == ["-", "-", "vgg16"]
    assert list(rows.slurry) == ["T1", "1", "1"]
    assert list(rows.model) == ["DEM", "DEM", "hybrid"]
    np.testing.assert_allclose(rows.volume_um3, [volume_um3, volume_um3, 1.1**3 * volume_um3])
    np.testing.assert_allclose(rows.density_g_cm3, 2 * N / rows.volume_um3)


def dem_run(folder: Path, slurry: str, density_g_cm3: np.ndarray) -> list[Path]:
    """Write run.json and thermo.csv of a run with this density every 2 us; four segments of 1000 steps."""
    segments = [
        {"step_start": 1000 * k, "step_end": 1000 * (k + 1), "wall_s": 2.0 + k, "cpu_s": 1.0 + k} for k in range(4)
    ]
    physics = {"slurry": {"mass_units": 2.6, "thickness_ratio": 1.6, "seed": 7}}
    run = {"slurry": slurry, "particles": N, "steps": 4000, "physics": physics, "segments": segments}
    run["start"] = {"wall_s": 0.5, "cpu_s": 0.25}
    paths = [folder / f"{slurry}_run.json", folder / f"{slurry}_thermo.csv"]
    paths[0].write_text(json.dumps(run))
    time_us = 2.0 * np.arange(len(density_g_cm3))
    contacts = np.linspace(0, 6.5, len(time_us))
    columns = {"step": np.arange(len(time_us)), "time_us": time_us, "density_g_cm3": density_g_cm3}
    pd.DataFrame(columns | {"mean_contacts": contacts}).to_csv(paths[1], index=False)
    return paths


def test_equilibrium(run, tmp_path):
    flat = np.minimum(1.2 + 0.05 * np.arange(101), 2.25)  # flat from 42 us of 200
    rising = np.linspace(1.25, 2.25, 101)  # the last 10 % add 0.1 g/cm3
    runs = [dem_run(tmp_path, "T1", flat), dem_run(tmp_path, "1", rising), dem_run(tmp_path, "N1", rising)]
    out = tmp_path / "equilibrium.csv"
    arguments = ["--run-json", *(r[0] for r in runs), "--thermo", *(r[1] for r in runs)]
    arguments += ["--roles", "train", "test", "new", "--max-density-drift", 0.002, "--table", out]
    process = run("measure_equilibrium.py", *arguments)
    rows = table(process, out)
    assert list(rows.columns) == [
        "slurry", "role", "mass_units", "thickness_ratio", "particles", "density_g_cm3", "mean_contacts",
        "density_drift", "time_to_equilibrium_us", "run_time_us", "warning",
    ]  # fmt: skip
    assert list(rows.slurry) == ["T1", "1", "N1"]
    assert list(rows.role) == ["train", "test", "new"]
    assert set(rows.mass_units) == {2.6}
    assert set(rows.run_time_us) == {200.0}
    np.testing.assert_allclose(rows.density_g_cm3, 2.25)
    np.testing.assert_allclose(rows.mean_contacts, 6.5)
    np.testing.assert_allclose(rows.density_drift, [0, 0.1 / 2.25, np.nan], atol=1e-8)
    assert rows.time_to_equilibrium_us[0] == pytest.approx(42)
    assert list(rows.warning.isna()) == [True, False, True]
    assert rows.warning[1] == (
        "not in equilibrium: density changed by +4.44 % over the last 10 % of the run, at most 0.2 % is allowed"
    )
    assert process.stderr == f"warning: slurry 1: {rows.warning[1]}\n"


def test_costs(run, tmp_path):
    records = [
        Cost("generate_inputs", "-", "T10", N),
        Cost("run_slurry", "-", "T10", N, 4000, 14.0, 10.0, 50.0),
        Cost("run_slurry", "-", "2", 2 * N, 4000, 28.0, 20.0, 60.0),
        Cost("train_surrogate", "vgg16", wall_s=123.4567890123, cpu_s=200.0, max_rss_mb=900.0),
        Cost("compare_rdf", wall_s=1.0),
    ]
    paths = [tmp_path / f"cost_{index}.json" for index in range(len(records))]
    for path, record in zip(paths, records, strict=True):
        path.write_text(json.dumps(asdict(record)))
    run_json = dem_run(tmp_path, "T10", np.ones(5))[0]
    out = tmp_path / "cost.csv"
    arguments = ["--costs", *paths, "--run-json", run_json, "--table", out]
    rows = table(run("collect_costs.py", *arguments, "--input-steps", 2000), out)
    columns = ["stage", "surrogate", "slurry", "particles", "steps", "wall_s", "cpu_s", "max_rss_mb"]
    assert list(rows.columns) == columns
    stages = ["generate_inputs", "run_slurry", "run_slurry", "run_slurry_to_input", "train_surrogate", "compare_rdf"]
    assert list(rows.stage) == stages
    assert list(rows.slurry) == ["T10", "T10", "2", "T10", "-", "-"]
    to_input = rows.iloc[3]
    assert (to_input.particles, to_input.steps, to_input.wall_s, to_input.cpu_s) == (N, 2000, 0.5 + 2 + 3, 0.25 + 1 + 2)
    assert np.isnan(to_input.max_rss_mb)
    assert "train_surrogate,vgg16,-,,,123.456789," in out.read_text()

    half_a_segment_more = table(run("collect_costs.py", *arguments, "--input-steps", 2500), out)
    assert half_a_segment_more.wall_s[3] == 0.5 + 2 + 3 + 0.5 * 4
    too_short = run("collect_costs.py", *arguments, "--input-steps", 5000)
    assert too_short.returncode == 1
    assert too_short.stderr == f"error: {run_json}: ends before step 5000 of the last input frame\n"


@pytest.mark.parametrize(
    ("script", "arguments", "message"),
    [
        (
            "compare_coordinates.py",
            ["--predicted", "a", "--frames", "b", "c", "--target-frame", 120],
            "1 --predicted but 2 --frames: one each is needed",
        ),
        (
            "measure_equilibrium.py",
            ["--run-json", "a", "--thermo", "b", "--roles", "test", "new", "--max-density-drift", 0.1],
            "--run-json, --thermo and --roles: as many of each are needed",
        ),
    ],
)
def test_lists_that_do_not_match_are_refused(run, tmp_path, script, arguments, message):
    for name in "abc":
        (tmp_path / name).touch()
    words = [tmp_path / word if word in ("a", "b", "c") else word for word in arguments]
    process = run(script, *words, "--table", tmp_path / "t.csv")
    assert process.returncode == 2
    assert message in process.stderr
