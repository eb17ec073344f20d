"""The scripts of the analysis, run on small made-up slurries."""

import json
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from script_runs import refusal, run_script, write_costs, written
from slurrycast.dem.relaxation import unrest
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
def outputs(tmp_path) -> dict[str, Path]:
    """Options for what most scripts write."""
    return {"table": tmp_path / "table.csv", "cost": tmp_path / "cost.json"}


def test_coordinate_errors(slurry, outputs):
    a, b = slurry("1", 11), slurry("2", 12)
    predicted, frames = ([paths[key] for paths in (a, b)] for key in ("predicted", "frames"))
    errors = written("compare_coordinates", predicted=predicted, frames=frames, target_frame=120, **outputs)
    measures = ["mse_um2", "mae_um", "r2", "mse_um2_true_box", "mae_um_true_box", "r2_true_box"]
    assert list(errors.columns) == ["surrogate", "slurry", "axis", *measures]
    keys = product(["vgg16"], ["1", "2"], ["x", "y", "z", "all"])
    assert list(errors.iloc[:, :3].itertuples(index=False, name=None)) == list(keys)
    # 10 % too large: R2 = 1 - 0.1^2 in its own box, exact in the true one.
    np.testing.assert_allclose(errors.r2, 1 - 0.1**2, rtol=1e-8)
    np.testing.assert_allclose(errors.mse_um2[:3], 0.01 * np.var(target_um(11), axis=0), rtol=1e-8)
    np.testing.assert_allclose(errors.mse_um2_true_box, 0, atol=1e-12)
    np.testing.assert_allclose(errors.r2_true_box, 1, atol=1e-12)
    assert read_cost(outputs["cost"]).stage == "compare_coordinates"


def test_a_prediction_of_another_slurry_is_refused(slurry, outputs):
    predicted, frames = slurry("1", 11)["predicted"], slurry("2", 12)["frames"]
    said = refusal("compare_coordinates", predicted=predicted, frames=frames, target_frame=120, **outputs)
    assert said == f"error: {predicted}: slurry 1, not the particles of {frames}\n"


@pytest.fixture
def rdf(tmp_path) -> dict[str, object]:
    """Options of compute_rdf.py but for the structures and the target frame."""
    return {"cutoff_um": 7, "bins": 120, "pair": ["NiO", "8YSZ"], "cost": tmp_path / "cost.json"}


def curves_of(path: Path, **options: object) -> pd.DataFrame:
    """The curves that compute_rdf.py writes."""
    done = run_script("compute_rdf", **options, rdf=path)
    assert done.returncode == 0, done.stderr
    return pd.read_csv(path, dtype={"slurry": str})


def test_rdf_and_its_differences(slurry, rdf, outputs, tmp_path):
    path = tmp_path / "1.csv"
    curves = curves_of(path, **slurry("1", 11), **rdf, target_frame=120)
    assert list(curves.columns) == ["surrogate", "slurry", "pair", "r_um", "g_dem", "g_predicted", "g_relaxed"]
    bins = int(0.49 * 6 / (7 / 120))  # the target's and the relaxed box have the shortest edge
    assert dict(curves.pair.value_counts()) == {"all": bins, "NiO-8YSZ": bins}
    np.testing.assert_allclose(np.diff(curves.r_um[:bins]), 7 / 120, rtol=1e-6)
    np.testing.assert_allclose(curves.g_relaxed, curves.g_dem)
    assert curves.g_predicted.between(0.5, 1.5)[bins - 20 : bins].all()
    cost = read_cost(rdf["cost"])
    assert (cost.stage, cost.surrogate, cost.slurry, cost.particles) == ("compute_rdf", "vgg16", "1", N)

    curves.g_relaxed += np.where(curves.pair == "all", 0.25, -0.5)
    write_text(path, curves.to_csv(index=False))
    errors = written("compare_rdf", rdf=path, **outputs)
    assert list(errors.columns) == ["surrogate", "slurry", "pair", "r_max_um", "bins", "mean_abs_difference"]
    assert list(errors.pair) == ["all", "NiO-8YSZ"]
    np.testing.assert_allclose(errors.mean_abs_difference, [0.25, 0.5])
    np.testing.assert_allclose(errors.r_max_um, bins * 7 / 120, rtol=1e-8)
    assert list(errors.bins) == [bins, bins]
    assert list(errors.slurry) == ["1", "1"]


def test_rdf_of_a_new_slurry_has_no_target(slurry, rdf, outputs, tmp_path):
    path = tmp_path / "N1.csv"
    structures = {key: of_slurry for key, of_slurry in slurry("N1", 13, last=10).items() if key != "frames"}
    curves = curves_of(path, **structures, **rdf | {"pair": ["8YSZ", "NiO"]})
    assert list(curves.pair.unique()) == ["all", "8YSZ-NiO"]  # in any order
    assert curves.g_dem.isna().all()
    assert curves[["g_predicted", "g_relaxed"]].notna().all(axis=None)
    said = refusal("compare_rdf", rdf=path, **outputs)
    assert said == f"error: {path}: g_dem is empty, only slurries with a target can be compared\n"


def test_an_unknown_phase_is_refused(slurry, rdf, tmp_path):
    options = slurry("1", 11) | rdf | {"target_frame": 120, "pair": ["NiO", "8ysz"]}
    done = run_script("compute_rdf", **options, rdf=tmp_path / "1.csv")
    assert done.returncode == 1
    assert done.stderr == "error: --pair 8ysz: no such particles, phases are BDPD, NiO, 8YSZ\n"


def test_a_phase_of_one_particle_has_no_rdf_with_itself(rdf, tmp_path):
    paths = {key: tmp_path / f"{key}.h5" for key in ("predicted", "relaxed")}
    for path in paths.values():
        end = frame(120, target_um(11), EDGES_UM)
        write_store(
            path, [end], particles(np.repeat([1, 2], [1, N - 1]), names=("A", "B")), slurry="1", surrogate="net"
        )
    done = run_script("compute_rdf", **paths, **rdf | {"pair": ["A", "A"]}, rdf=tmp_path / "1.csv")
    assert (done.returncode, done.stderr) == (1, "error: --pair A A: there is 1 particle of A, must be at least 2\n")


def test_density_and_volume(slurry, outputs):
    a, b = slurry("1", 11), slurry("T1", 12)
    structures = {"frames": [b["frames"], a["frames"]], "relaxed": a["predicted"], "target_frame": 120}
    rows = written("measure_density", **structures, **outputs)
    assert list(rows.columns) == ["surrogate", "slurry", "model", "density_g_cm3", "volume_um3"]
    volume_um3 = 6 * 6 * 12
    keys = [("-", "T1", "DEM"), ("-", "1", "DEM"), ("vgg16", "1", "hybrid")]
    assert list(rows.iloc[:, :3].itertuples(index=False, name=None)) == keys
    np.testing.assert_allclose(rows.volume_um3, [volume_um3, volume_um3, 1.1**3 * volume_um3])
    np.testing.assert_allclose(rows.density_g_cm3, 2 * N / rows.volume_um3)


def dem_run(folder: Path, slurry: str, density_g_cm3: np.ndarray) -> list[Path]:
    """Write run.json and thermo.csv of a run with this density every 2 us; four segments of 1000 steps."""
    segments = [
        {"step_start": 1000 * k, "step_end": 1000 * (k + 1), "wall_s": 2.0 + k, "cpu_s": 1.0 + k} for k in range(4)
    ]
    physics = {"slurry": {"mass_units": 2.6, "thickness_ratio": 1.6, "seed": 7}, "dem": {"pressure_kpa": 100.0}}
    run = {"slurry": slurry, "particles": N, "steps": 4000, "physics": physics, "segments": segments}
    run["start"] = {"wall_s": 0.5, "cpu_s": 0.25}
    paths = [folder / f"{slurry}_run.json", folder / f"{slurry}_thermo.csv"]
    paths[0].write_text(json.dumps(run))
    time_us = 2.0 * np.arange(len(density_g_cm3))
    rows = np.arange(len(time_us))
    columns = {"step": rows, "time_us": time_us, "density_g_cm3": density_g_cm3}
    columns |= {"mean_contacts": np.linspace(0, 6.5, len(time_us)), "lx_um": 5.0, "ly_um": 5.0, "lz_um": 8.0}
    columns |= {"temperature_k": 1000.0 * rows, "temperature_rotational_k": 10.0 * rows}
    pd.DataFrame(columns).to_csv(paths[1], index=False)
    return paths


def test_equilibrium(outputs, tmp_path):
    flat = np.minimum(1.2 + 0.05 * np.arange(101), 2.25)  # flat from 42 us of 200
    rising = np.linspace(1.25, 2.25, 101)  # the last 10 % add 0.1 g/cm3
    densities = {"T1": flat, "1": rising, "N1": rising}
    run_json, thermo = zip(*(dem_run(tmp_path, name, density) for name, density in densities.items()), strict=True)
    options = {"run_json": run_json, "thermo": thermo, "roles": ["train", "test", "new"], "max_density_drift": 0.002}
    rows = written("measure_equilibrium", **options, **outputs)
    assert list(rows.columns) == [
        "slurry", "role", "mass_units", "thickness_ratio", "particles", "density_g_cm3", "mean_contacts",
        "density_drift", "time_to_equilibrium_us", "temperature_densifying_k", "temperature_k",
        "temperature_rotational_k", "kinetic_share", "run_time_us", "warning",
    ]  # fmt: skip
    keys = [("T1", "train", 2.6), ("1", "test", 2.6), ("N1", "new", 2.6)]
    assert list(rows.iloc[:, :3].itertuples(index=False, name=None)) == keys
    assert set(rows.run_time_us) == {200.0}
    np.testing.assert_allclose(rows.density_g_cm3, 2.25)
    np.testing.assert_allclose(rows.mean_contacts, 6.5)
    np.testing.assert_allclose(rows.density_drift, [0, 0.1 / 2.25, np.nan], atol=1e-8)
    assert rows.time_to_equilibrium_us[0] == pytest.approx(42)
    # rows 1 to 20 and 1 to 97, 1000 K more in each: the next one is the first from 99 % of 2.25 g/cm3 on
    np.testing.assert_allclose(rows.temperature_densifying_k, [10500, 49000, 49000])
    assert {*rows.temperature_k, *rows.temperature_rotational_k} == {100000, 1000}
    share = 1.5 * 1.3806504e-8 * ((N - 1) * 100000 + N * 1000) / (100 * 5 * 5 * 8)
    np.testing.assert_allclose(rows.kinetic_share, share, rtol=1e-8)
    assert list(rows.warning.isna()) == [True, False, True]
    assert rows.warning[1] == (
        "not in equilibrium: density changed by +4.44 % over the last 10 % of the run, at most 0.2 % is allowed"
    )
    said = run_script("measure_equilibrium", **options, **outputs).stderr
    assert said == f"warning: slurry 1: {rows.warning[1]}\n"


@pytest.mark.parametrize(
    ("pressure_kpa", "kinetic_share", "box_rule", "densification", "warning"),
    [
        (101.9, 1e-4, "loose_packing", 1.1, None),
        (97.9, 9e-5, "last_frame", 1.0, "not at rest: pressure is -2.1 % off, at most 2 % is allowed"),
        (
            100.0,
            1e-5,
            "loose_packing",
            1.03,
            "ends only 1.03 times as dense as its random start: set surrogate.direct.packing_fraction lower",
        ),
        (
            103.0,
            2e-4,
            "last_frame",
            1.0,
            "not at rest: kinetic energy is 0.0002 of pressure x volume, at most 0.0001 is allowed; "
            "pressure is +3 % off, at most 2 % is allowed",
        ),
    ],
)
def test_ends_of_relaxations(outputs, tmp_path, pressure_kpa, kinetic_share, box_rule, densification, warning):
    end = {"temperature_k": 700.0, "temperature_rotational_k": 40.0, "pressure_kpa": pressure_kpa}
    end |= {"kinetic_share": kinetic_share, "densification": densification}
    origin = {"slurry": "2", "surrogate": "net", "box_rule": box_rule, "relaxation": json.dumps({"steps": 2400})}
    path = tmp_path / "relaxed.h5"
    write_store(path, [frame(0, target_um(1), EDGES_UM)], PARTICLES, **origin, **end)
    bounds = {"pressure_kpa": 100.0, "max_kinetic_share": 1e-4, "pressure_within": 0.02, "temperature_k": 300}
    (row,) = written("measure_relaxation", relaxed=path, **bounds, **outputs).to_dict("records")
    said = run_script("measure_relaxation", relaxed=path, **bounds, **outputs).stderr
    assert said == (f"warning: net, slurry 2: {warning}\n" if warning else "")
    expected = {"surrogate": "net", "slurry": "2", "steps": 2400} | end
    assert {name: row[name] for name in expected} == expected
    assert row["warning"] == warning if warning else pd.isna(row["warning"])


@pytest.mark.parametrize(("set_point_k", "warned"), [(300.0, True), (400.0, False)])
def test_small_particles_at_the_set_point_are_at_rest(set_point_k, warned):
    end = {"temperature_k": 700.0, "pressure_kpa": 100.0, "kinetic_share": 2e-4}
    assert bool(unrest(end, 100.0, 1e-4, 0.02, set_point_k)) == warned


def test_a_structure_that_was_not_relaxed_is_refused(slurry, outputs):
    path = slurry("1", 11)["predicted"]
    bounds = {"pressure_kpa": 100.0, "max_kinetic_share": 1e-4, "pressure_within": 0.02, "temperature_k": 300}
    said = refusal("measure_relaxation", relaxed=path, **bounds, **outputs)
    missing = "temperature_k, temperature_rotational_k, pressure_kpa, kinetic_share, densification"
    assert said == f"error: {path}: no attribute {missing}, must be the output of relax_slurry\n"


def test_costs(tmp_path):
    records = [
        Cost("generate_inputs", "-", "T10", N),
        Cost("run_slurry", "-", "T10", N, 4000, 14.0, 10.0, 50.0),
        Cost("run_slurry", "-", "2", 2 * N, 4000, 28.0, 20.0, 60.0),
        Cost("train_surrogate", "vgg16", wall_s=123.4567890123, cpu_s=200.0, max_rss_mb=900.0),
        Cost("compare_rdf", wall_s=1.0),
    ]
    paths = write_costs(tmp_path, records)
    run_json, out = dem_run(tmp_path, "T10", np.ones(5))[0], tmp_path / "cost.csv"
    options = {"costs": paths, "run_json": run_json, "table": out}
    rows = written("collect_costs", **options, input_steps=2000)
    columns = ["stage", "surrogate", "slurry", "particles", "steps", "wall_s", "cpu_s", "max_rss_mb"]
    assert list(rows.columns) == columns
    stages = ["generate_inputs", "run_slurry", "run_slurry", "run_slurry_to_input", "train_surrogate", "compare_rdf"]
    assert list(rows.stage) == stages
    assert list(rows.slurry) == ["T10", "T10", "2", "T10", "-", "-"]
    to_input = rows.iloc[3]
    assert (to_input.particles, to_input.steps, to_input.wall_s, to_input.cpu_s) == (N, 2000, 0.5 + 2 + 3, 0.25 + 1 + 2)
    assert np.isnan(to_input.max_rss_mb)
    assert "train_surrogate,vgg16,-,,,123.456789," in out.read_text()

    half_a_segment_more = written("collect_costs", **options, input_steps=2500)
    assert half_a_segment_more.wall_s[3] == 0.5 + 2 + 3 + 0.5 * 4
    too_short = run_script("collect_costs", **options, input_steps=5000)
    assert too_short.returncode == 1
    assert too_short.stderr == f"error: {run_json}: ends before step 5000 of the last input frame\n"


@pytest.mark.parametrize(
    ("script", "files", "options", "message"),
    [
        (
            "compare_coordinates",
            {"predicted": "a", "frames": "bc"},
            {"target_frame": 120},
            "1 --predicted but 2 --frames: one each is needed",
        ),
        (
            "measure_equilibrium",
            {"run_json": "a", "thermo": "b"},
            {"roles": ["test", "new"], "max_density_drift": 0.1},
            "--run-json, --thermo and --roles: as many of each are needed",
        ),
    ],
)
def test_lists_that_do_not_match_are_refused(outputs, tmp_path, script, files, options, message):
    for name in "abc":
        (tmp_path / name).touch()
    files = {option: [tmp_path / name for name in names] for option, names in files.items()}
    done = run_script(script, **files, **options, **outputs)
    assert done.returncode == 2
    assert message in done.stderr
