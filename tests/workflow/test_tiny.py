"""The whole workflow at tiny scale, with real LAMMPS and real Keras, in a checkout whose path has spaces."""

import json
import math
import re
from itertools import product
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
import yaml

from checkouts import copy_checkout, snakemake
from configurations import HEADER
from html_pages import Page
from pictures import is_drawn
from slurrycast.data.frames import read_frames
from slurrycast.runtime.files import CHECKSUMS, check_unchanged, checksum
from torture.comparison import ASIDE, OF_TIME, content

SLURRIES = {"T1": "train", "T2": "train", "T3": "train", "1": "test", "2": "test", "V1": "validation", "N1": "new"}
HELD_OUT = ("1", "2", "V1")
PREDICTED = (*HELD_OUT, "N1")
SURROGATES = ["direct", "persistence", "affine", "linear_box", "vgg16"]
FURTHER = ["direct_box", "neighbours", "vgg16_box", "vgg16_box_nobox", "affine_f02", "driven_dem"]
FURTHER += ["early_dem_x2", "early_dem_x10", "early_dem_x10_f02"]
FROM_RECIPE = ("direct", "direct_box")  # their coordinates are not those of any DEM
TRACKED = [label for label in SURROGATES if label not in FROM_RECIPE]
ALL_TRACKED = [label for label in [*SURROGATES, *FURTHER] if label not in FROM_RECIPE]
TINY = ("--configfile", "config/tiny.yaml")
# Tables of a second run; what is drawn or reported from tables is left out.
SECOND_RUN = ["density_volume", "coordinate_errors", "rdf_errors", "equilibrium", "training_range", "noise", "skill"]
SECOND_RUN += ["structure_errors", "verdicts", "ablation", "uncertainty", "relaxation_ends", "microstructure"]
SECOND_RUN += ["drying_ends", "drying_calibration", "tape_errors", "tape_verdicts"]
# Each of these is there for every slurry, surrogate or table.
FOLDERS = {"dem", "frames", "dataset", "models", "hybrid", "rdf", "perturbed", "structure", "tables", "tape"}
# Seconds derive from seconds, like those of OF_TIME.
TIMED = ["cost", "speedup", "front", "equal_cost", "cost_scaling", "article_costs", "relaxation"]
TIMED += ["timestep", "timestep_summary"]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def again(tmp_path_factory) -> Path:
    """The tiny configuration in another checkout, one job after the other."""
    project = copy_checkout(tmp_path_factory.mktemp("again"))
    tables = [f"results/tiny/tables/{name}.csv" for name in SECOND_RUN]
    snakemake(project, *tables, "models", "--cores", "1", "--configfile", "config/tiny.yaml")
    return project / "results" / "tiny"


@pytest.mark.full
def test_two_fresh_runs_are_equal(evaluation, again):
    """On one machine and one MPI rank, in each file that is not about time; models by their weights and layers."""
    names = [path.relative_to(again).as_posix() for path in again.rglob("*") if path.is_file()]
    compared = [name for name in names if not OF_TIME.fullmatch(name) and not ASIDE.fullmatch(name)]
    assert {name.partition("/")[0] for name in compared if "/" in name} >= FOLDERS
    assert [name for name in compared if content(evaluation / name) != content(again / name)] == []


def test_every_table_is_compared_or_holds_times(evaluation):
    assert {path.stem for path in (evaluation / "tables").glob("*.csv")} == {*SECOND_RUN, *TIMED}


def test_comparison_sees_the_last_bit(results, tmp_path):
    """What the test above would say if one number differed."""
    kept = json.loads((results / "models" / "linear_box" / "model.json").read_text())
    kept["training_mse_um2"] *= 1 + 2**-52
    (tmp_path / "model.json").write_text(json.dumps(kept, indent=1) + "\n")
    assert content(tmp_path / "model.json") != content(results / "models" / "linear_box" / "model.json")


def test_contract(results):
    """Every file that other tools rely on is there, and no work folder or dump is left, but for the trained models."""
    expected = ["config.yaml", "versions.json", "report.html", "dataset/training.h5"]
    expected += [f"dem/{slurry}/frame_10.restart" for slurry in SLURRIES]
    expected += [f"frames/{slurry}.h5" for slurry in SLURRIES]
    expected += ["models/vgg16/model.keras", "models/vgg16/history.csv", "models/linear_box/model.json"]
    expected += [
        f"hybrid/{surrogate}/{slurry}/{name}"
        for surrogate in SURROGATES
        for slurry in PREDICTED
        for name in ("predicted.h5", "wrapped.data", "relaxed.data")
    ]
    assert [name for name in expected if not (results / name).is_file()] == []
    left = {
        path.relative_to(results).as_posix() for path in results.rglob("*") if path.name in ("work", "dump.lammpstrj")
    }
    assert left == {
        path.with_name("work").relative_to(results).as_posix() for path in results.glob("models/*/history.csv")
    }


def test_frames(results):
    """Complete slurries have 121 frames, a new one ends at its last input frame; all at the steps asked for."""
    for slurry, role in SLURRIES.items():
        with h5py.File(results / "frames" / f"{slurry}.h5") as file:
            steps = file["particles/slurry/position/step"][:]
            np.testing.assert_array_equal(steps, 200 * np.arange(11 if role == "new" else 121))


def table(results: Path, name: str) -> pd.DataFrame:
    """A table of results; its columns are those that the tests of its script expect."""
    return pd.read_csv(results / "tables" / f"{name}.csv", dtype={"slurry": str})


def test_tables(results):
    names = ("density_volume", "coordinate_errors", "rdf_errors", "cost", "training_range")
    tables = {name: table(results, name) for name in names}
    density = tables["density_volume"]
    dem = density[density.model == "DEM"]
    assert set(dem.slurry) == {slurry for slurry, role in SLURRIES.items() if role != "new"}
    assert set(dem.surrogate) == {"-"}
    assert dem.density_g_cm3.between(2.1, 2.35).all()
    hybrid = density[density.model == "hybrid"]
    assert sorted(zip(hybrid.surrogate, hybrid.slurry, strict=True)) == sorted(product(SURROGATES, PREDICTED))

    errors, key = tables["coordinate_errors"], ["surrogate", "slurry"]
    found = zip(errors.surrogate, errors.slurry, errors.axis, strict=True)
    assert sorted(found) == sorted(product(TRACKED, HELD_OUT, ("x", "y", "z", "all")))
    axes = errors[errors.axis != "all"].groupby(key).mse_um2.mean()
    np.testing.assert_allclose(axes, errors[errors.axis == "all"].set_index(key).mse_um2.loc[axes.index], rtol=1e-6)
    rdf = tables["rdf_errors"]
    found = zip(rdf.surrogate, rdf.slurry, rdf.pair, strict=True)
    assert sorted(found) == sorted(product(SURROGATES, HELD_OUT, ("all", "NiO-8YSZ")))
    ranges = tables["training_range"]
    quantities = ["particles", "shortest_edge_um", "longest_edge_um", "density_g_cm3", "thickness_ratio"]
    quantities += ["fraction_BDPD", "fraction_NiO", "fraction_8YSZ", "mean_radius_um"]
    quantities += [
        f"{name}_{phase}" for phase in ("BDPD", "NiO", "8YSZ") for name in ("mean_radius_um", "density_g_cm3")
    ]
    assert list(zip(ranges.slurry, ranges.quantity, strict=True)) == list(product([*HELD_OUT, "N1"], quantities))
    of_recipe = ~ranges.quantity.isin(["shortest_edge_um", "longest_edge_um", "density_g_cm3"])
    assert set(ranges.outside[of_recipe]) == {"no"}  # mass, shape and recipe are those of T1 to T3
    cost = tables["cost"]
    assert (cost.wall_s > 0).all()
    full = cost[cost.stage == "run_slurry"].set_index("slurry").wall_s
    part = cost[cost.stage == "run_slurry_to_input"].set_index("slurry").wall_s
    assert (part < full[part.index]).all()


def test_tapes_beside_the_scatter_of_their_replicas(results):
    """Of both stages, scaled to each slurry; those that the main job dries are all there."""
    rows = table(results, "microstructure")
    tapes = [*product(["dem"], "12"), *product(["direct"], ["1", "2", "N1"])]
    assert list(rows.groupby(["source", "slurry"], sort=False).groups) == tapes
    known = rows[rows.quantity.isin(["green_density", "share_void_union", "tortuosity_z_0.3um"])]
    assert (known.replica_sd[known.quantity != "tortuosity_z_0.3um"] > 0).all()
    assert (known.replica_sd[known.quantity == "tortuosity_z_0.3um"] > 0).sum() == 2  # of the tapes of slurry 1
    ends = table(results, "drying_ends")
    assert list(zip(ends.source, ends.slurry, strict=True)) == [*tapes, ("dem", "1_r1"), ("dem", "1_r2")]
    cost = table(results, "cost")
    assert list(cost.stage[cost.slurry == "1_r1"]) == [
        *["generate_inputs", "run_slurry", "extract_frames", "dry_slurry"],
        *["measure_microstructure"] * 2,
    ]


def test_figures(results):
    """Every figure is there and shows something."""
    figures = {path.name for path in (results / "figures").glob("*.png")}
    expected = {"workflow", "densification", "learning_curves_vgg16", "density", "rdf", "costs"}
    expected |= {f"coordinates_{slurry}" for slurry in HELD_OUT}
    assert {f"{name}.png" for name in expected} <= figures  # 3D pictures are off at this scale
    for name in figures:
        assert is_drawn(results / "figures" / name), name


def opened_offline(path: Path) -> str:
    """Text of a page that loads nothing from anywhere."""
    page = Page(path.read_text(encoding="utf-8"))
    assert page.images and page.loads_nothing
    return page.text


def test_report(results):
    """The report opens without a network and shows the numbers of the tables."""
    text = opened_offline(results / "report.html")
    density = table(results, "density_volume")
    for value in density[density.slurry == "1"].density_g_cm3:
        assert f"{value:.4f}" in text
    assert ("No predicted slurry lies outside" in text) == (table(results, "training_range").outside == "no").all()


def test_snakemake_report(project, results):
    """Figures and tables with captions, as Snakemake itself packs them."""
    said = snakemake(project, "--report", "packed.html", *TINY)
    assert "WARNING" not in said  # of a caption that cannot be typeset
    assert "radial distribution function" in (project / "packed.html").read_text(encoding="utf-8")


def test_every_table_can_be_traced_to_the_versions_that_made_it(evaluation):
    versions = json.loads((evaluation / "versions.json").read_text(encoding="utf-8"))
    assert {"lammps", "keras", "snakemake", "MDAnalysis"} <= set(versions["packages"])
    tables = sorted((evaluation / "tables").glob("*.csv"))
    assert len(tables) > 10
    for table in tables:
        check_unchanged(table)
        sum_, name = (table.parent / CHECKSUMS / f"{table.name}.sha256").read_text(encoding="utf-8").splitlines()
        assert sum_ == f"{checksum(table)}  {table.name}"
        made_with = evaluation / "versions" / f"{name.removeprefix('# versions ')}.json"
        assert json.loads(made_with.read_text(encoding="utf-8")) == versions


def test_evaluation_tables(evaluation):
    tables = {path.stem: table(evaluation, path.stem) for path in (evaluation / "tables").glob("*.csv")}
    skill, front = tables["skill"], tables["front"]
    for rows, labels in ((skill, ALL_TRACKED), (front, [*SURROGATES, *FURTHER])):
        assert sorted(zip(rows.surrogate, rows.slurry, strict=True)) == sorted(product(labels, HELD_OUT))
    # with what the coordinate errors of the main job say
    errors = tables["coordinate_errors"].query("axis == 'all'").set_index(["surrogate", "slurry"]).mse_um2
    np.testing.assert_allclose(skill.set_index(["surrogate", "slurry"]).mse_um2.loc[errors.index], errors, rtol=1e-6)
    assert (skill[skill.surrogate == "affine"].skill.abs() < 1e-9).all()
    assert (skill.floor_um2 > 0).all()
    assert dict(zip(front.surrogate, front.input_last_frame, strict=True)) == {
        label: 0 if label in FROM_RECIPE else 2 if label.endswith("_f02") else 10 for label in [*SURROGATES, *FURTHER]
    }
    assert (front.cost_share_of_full_dem > 0).all()

    uncertainty = tables["uncertainty"].set_index(["slurry", "level"])
    assert set(uncertainty.surrogate) == {"neighbours"}
    assert list(uncertainty.index) == list(product(HELD_OUT, (0.5, 0.9)))
    assert dict(zip(tables["uncertainty"].slurry, tables["uncertainty"].role, strict=True)) == {
        slurry: SLURRIES[slurry] for slurry in HELD_OUT
    }
    # calibrated on the one validation slurry: as many coordinates are covered as the level asks for, and no more
    n = 3 * tables["equilibrium"].set_index("slurry").particles["V1"]
    for level in (0.5, 0.9):
        assert uncertainty.coverage["V1", level] == pytest.approx(math.ceil((n + 1) * level) / n, abs=1e-8)
    calibration = json.loads((evaluation / "models" / "neighbours" / "calibration.json").read_text())
    assert (calibration["slurries"], calibration["coordinates"]) == (["V1"], n)
    mse = skill[skill.surrogate == "neighbours"].set_index("slurry").mse_um2
    rms_um = uncertainty.xs(0.9, level="level").rms_error_um
    np.testing.assert_allclose(rms_um**2, mse[rms_um.index], rtol=1e-6)

    structure = tables["structure_errors"]
    assert set(structure.stage) == {"predicted", "relaxed"}
    relaxed = structure[(structure.stage == "relaxed") & (structure.quantity == "density_g_cm3")]
    hybrid = tables["density_volume"].query("model == 'hybrid' and slurry != 'N1'").set_index(["surrogate", "slurry"])
    of_structure = relaxed.set_index(["surrogate", "slurry"]).value.loc[hybrid.index]
    np.testing.assert_allclose(of_structure, hybrid.density_g_cm3, rtol=1e-6)
    assert structure.replica_sd.notna().all()  # 0 is possible: two so small replicas may have as many contacts
    assert (relaxed.replica_sd > 0).all()
    assert list(dict.fromkeys(tables["verdicts"].surrogate)) == list(dict.fromkeys(structure.surrogate))
    assert tables["verdicts"].verdict.isna().all()  # of fewer than three test slurries
    assert set(tables["noise"].slurry) == {"1", "2"}
    assert set(tables["ablation"].surrogate) == {"affine", "vgg16", "vgg16_box", "vgg16_box_nobox"}
    errors = tables["tape_errors"]
    assert set(zip(errors.source, errors.slurry, errors.stage, strict=True)) == {
        *product(["dem", "direct"], "12", ["tape"])
    }
    assert len(tables["timestep"]) == 4
    assert list(tables["timestep_summary"].timestep_us) == [0.001, 0.002]


def test_relaxations_of_several_lengths(evaluation):
    """A row a surrogate, validation slurry and number of steps, and its part of the page."""
    text = (evaluation / "evaluation.html").read_text(encoding="utf-8")
    assert "Relaxations of 300 and 1,000 steps" in text
    rows, structure = (table(evaluation, name) for name in ("relaxation", "structure_errors"))
    found = zip(rows.surrogate, rows.slurry, rows.steps, strict=True)
    assert sorted(found) == sorted(product([*SURROGATES, *FURTHER], ["V1"], (300, 1000)))
    own = structure.query("slurry == 'V1' and quantity == 'density_g_cm3' and stage == 'relaxed'").set_index(
        "surrogate"
    )
    of_main_job = rows[rows.steps == 1000].set_index("surrogate").density_error
    expected = (own.value / own.dem_value - 1).loc[of_main_job.index]
    np.testing.assert_allclose(of_main_job, expected, atol=1e-7)
    assert (rows.cpu_s > 0).all()
    assert rows.density_in_sd.notna().all()


def test_evaluation_page(evaluation):
    text = opened_offline(evaluation / "evaluation.html")
    for label in [*SURROGATES, *FURTHER]:
        assert label in text
    assert "The 90% intervals of neighbours, calibrated on the validation slurries," in text
    for name in ("verdicts", "skill", "front", "relaxation", "uncertainty", "timesteps"):
        assert is_drawn(evaluation / "figures" / f"{name}.png"), name


def test_nothing_to_do_on_the_second_run(project, evaluation):
    assert "Nothing to be done" in snakemake(
        project, "all", "evaluation", "convergence", "tapes", "tape_evaluation", *TINY
    )


def test_edited_code_reruns_what_uses_it_and_never_a_dem(project, results):
    edits = {"analysis/rdf.py": "# edited", "data/frames.py": "from slurrycast.data import periodic  # noqa"}
    paths = {project / "scripts" / "slurrycast" / module: edit for module, edit in edits.items()}
    before = {path: path.read_text() for path in paths}
    for path, edit in paths.items():
        path.write_text(f"{before[path]}\n{edit}\n")
    try:
        plan = snakemake(project, "--dry-run", *TINY)
    finally:
        for path, text in before.items():
            path.write_text(text)
    rules = set(re.findall(r"^(?:local)?rule (\w+):", plan, re.MULTILINE))
    assert {"compute_rdf", "assemble_dataset"} <= rules
    assert not rules & {"generate_inputs", "run_slurry", "extract_frames"}


def test_new_slurry_from_its_recipe_alone(project):
    """Without training slurries, a model, a packing fraction and a DEM, to the report."""
    (project / "config" / "alone.tsv").write_text(HEADER + "X\tnew\t1\t1.0\t7\n")
    config = yaml.safe_load((project / "config" / "tiny.yaml").read_text())
    config |= {"run": {"name": "alone"}, "slurries": "config/alone.tsv", "surrogate": {"names": ["direct"]}}
    config |= {"evaluation": {"surrogates": ["affine"]}, "report": {"pictures": ["direct"]}}
    (project / "config" / "alone.yaml").write_text(yaml.safe_dump(config))
    options = ("--configfile", "config/alone.yaml")
    said = snakemake(project, "all", "tables", *options)
    assert "rule run_slurry" not in said and "rule extract_frames" not in said
    alone = project / "results" / "alone"
    with read_frames(alone / "hybrid" / "direct" / "X" / "relaxed.h5") as store:
        density_g_cm3 = store.density_g_cm3(store.last)
    assert 2.0 < density_g_cm3 < 2.4
    tables = {path.stem: table(alone, path.stem) for path in (alone / "tables").glob("*.csv")}
    assert {name for name, rows in tables.items() if rows.empty} == {"equilibrium", "coordinate_errors", "rdf_errors"}
    assert tables["density_volume"].density_g_cm3[0] == pytest.approx(density_g_cm3)
    chain = tables["cost"].stage[tables["cost"].slurry == "X"]
    stages = ["generate_inputs", "predict_slurry", "wrap_slurry", "relax_slurry", "compute_rdf"]
    assert list(chain) == [
        *stages,
        "calibrate_drying",
        "dry_slurry",
        "measure_microstructure",
        "measure_microstructure",
    ]
    assert (tables["speedup"].hybrid > 0).all() and tables["speedup"].dem.isna().all()
    figures = {path.stem for path in (alone / "figures").glob("*.png")}
    assert figures == {"workflow", "density", "rdf", "slurry_direct_X", "render_tape_X", "drying", "pores_X"}
    page = Page((alone / "report.html").read_text(encoding="utf-8"))
    assert page.images == len(figures) and page.loads_nothing
    assert f"{density_g_cm3:.4f}" in page.text
    assert "Left out" in page.text and "affine" in page.text


def test_new_slurry_with_a_trained_model(project, results):
    """What the surrogate is for: one unknown slurry, a model that exists, no training and no full DEM."""
    (project / "config" / "one.tsv").write_text(HEADER + "X\tnew\t1\t1.0\t7\n")
    config = yaml.safe_load((project / "config" / "tiny.yaml").read_text())
    config["run"]["name"], config["slurries"] = "one", "config/one.tsv"
    config["surrogate"]["models"] = {"vgg16": "results/tiny/models/vgg16/model.keras"}
    (project / "config" / "one.yaml").write_text(yaml.safe_dump(config))
    said = snakemake(project, "--configfile", "config/one.yaml")
    assert "train_surrogate" not in said
    one = project / "results" / "one"
    density = pd.read_csv(one / "tables" / "density_volume.csv")
    # the others would need the training slurries
    assert list(density.surrogate) == ["direct", "persistence", "vgg16"]
    assert set(density.model) == {"hybrid"}
    assert density.density_g_cm3[[0, 2]].between(2.0, 2.4).all()
    report = (one / "report.html").read_text(encoding="utf-8")
    assert "Fig. 6" in report
    assert "trained elsewhere" in report
    assert "range is not known here" not in report
    ranges = pd.read_csv(one / "tables" / "training_range.csv").set_index("quantity")
    assert set(ranges.model) == {"vgg16"}
    assert set(ranges.outside.drop(["shortest_edge_um", "longest_edge_um", "density_g_cm3"])) == {"no"}
    assert (one / "models" / "vgg16" / "trained_on.json").read_bytes() == (
        project / "results" / "tiny" / "models" / "vgg16" / "trained_on.json"
    ).read_bytes()
    assert pd.read_csv(one / "tables" / "coordinate_errors.csv").empty
