"""Slurries of three recipes in one run at tiny scale, with real LAMMPS and Keras.

One recipe is not trained on, and has a phase of its own in place of one of the RDF's.
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from checkouts import copy_checkout, snakemake
from configurations import HEADER
from html_pages import Page
from slurrycast.data.dataset import read_training_set
from slurrycast.data.frames import read_frames

pytestmark = pytest.mark.slow
ROWS = {
    "T1": ("train", ""),
    "T2": ("train", "binder"),
    "1": ("test", ""),
    "2": ("test", "binder"),
    "3": ("test", "ceria"),
}
SURROGATES = ["direct", "affine", "vgg16_box", "neighbours"]


def phase(mass_fraction: float, density_g_cm3: float, diameter_um: float) -> dict:
    classes = [{"diameter_um": diameter_um, "number_fraction": 1.0}]
    return {"mass_fraction": mass_fraction, "density_g_cm3": density_g_cm3, "size_classes": classes}


BINDER = {"8YSZ": phase(0.34, 5.96, 0.7), "BDPD": phase(0.18, 0.8135, 1.1), "NiO": phase(0.48, 6.67, 0.8)}
CERIA = {"GDC": phase(0.35, 7.2, 0.7), "NiO": phase(0.52, 6.67, 0.8), "BDPD": phase(0.13, 0.8135, 1.1)}
CHANGES = {
    "run": {"name": "recipes"},
    "slurries": "recipes.tsv",
    "formulation": {"unit_mass_pg": 200.0},
    "formulations": {
        "binder": {"phases": BINDER, "expected_density_g_cm3": 2.0, "drying": {"solvent_mass_fraction": 0.5}},
        "ceria": {"phases": CERIA, "force_field": {"granular_hertz": {"friction": 0.1}}},
    },
    "surrogate": {"names": SURROGATES, "neighbours": {"members": 1, "epochs": 1}},
    "evaluation": {"surrogates": []},
}


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    project = copy_checkout(tmp_path_factory.mktemp("recipes"))
    rows = [f"{id}\t{role}\t1\t1.0\t{seed}\t{name}" for seed, (id, (role, name)) in enumerate(ROWS.items(), 1)]
    (project / "recipes.tsv").write_text(HEADER.replace("\n", "\tformulation\n") + "\n".join(rows) + "\n")
    (project / "recipes.yaml").write_text(yaml.safe_dump(CHANGES, sort_keys=False))
    snakemake(project, "--cores", "2", "--configfile", "config/tiny.yaml", "recipes.yaml")
    return project / "results" / "recipes"


def test_each_slurry_is_of_its_recipe(results):
    for slurry, phases in (("2", BINDER), ("3", CERIA)):
        inputs = json.loads((results / "dem" / slurry / "inputs.json").read_text())
        wanted = {name: settings["mass_fraction"] for name, settings in phases.items()}
        assert inputs["mass_fractions_reached"] == pytest.approx(wanted, abs=0.02)
        friction = inputs["physics"]["force_field"]["granular_hertz"]["friction"]
        assert friction == (0.1 if slurry == "3" else 0.015)
        drying = pd.read_csv(results / "tape" / "direct" / slurry / "drying.csv")
        solvent = (0.5 if slurry == "2" else 0.594) * phases["BDPD"]["mass_fraction"]
        mass = drying.density_g_cm3 * drying.thickness_um  # at one area
        assert mass.iloc[-1] / mass.iloc[0] == pytest.approx(1 - solvent, abs=0.02 * solvent + 0.005)


def test_packing_fractions_are_those_of_each_recipe(results):
    """Of its training slurries, else of what `direct` makes of it."""
    for stem, source, slurry in (("", "dem", "T1"), ("_binder", "dem", "T2"), ("_ceria", "direct", "3")):
        packing = json.loads((results / "dataset" / f"packing_fraction{stem}.json").read_text())
        assert packing["source"] == source and list(packing["slurries"]) == [slurry]
        predicted = {"T1": "1", "T2": "2", "3": "3"}[slurry]
        with read_frames(results / "hybrid" / "affine" / predicted / "predicted.h5") as store:
            volume_um3 = (4 / 3 * np.pi * store.particles.radius_um**3).sum()
            assert volume_um3 / store.volume_um3(store.last) == pytest.approx(packing["mean"])


def test_phases_have_one_number_in_all_slurries(results):
    """In the training set that of the first recipe; files of a slurry number its own phases, in the same order."""
    data = read_training_set(results / "dataset" / "training.h5")
    for slurry, folder in (("T1", "frames"), ("T2", "frames")):
        with read_frames(results / folder / f"{slurry}.h5") as store:
            found = data.features[data.slurry_index == data.slurries.index(slurry), 0, 0]
            names = [["BDPD", "NiO", "8YSZ", "GDC"][int(number) - 1] for number in found]
            assert names == [store.particles.phase_names[number - 1] for number in store.particles.phase]
    for path in ("frames/3.h5", "hybrid/neighbours/3/predicted.h5", "hybrid/vgg16_box/3/relaxed.h5"):
        with read_frames(results / path) as store:
            assert store.particles.phase_names == ("BDPD", "NiO", "GDC")
            assert set(store.particles.phase) == {1, 2, 3}


def test_the_pair_of_the_rdf_is_left_out_where_a_phase_is_missing(results):
    errors = pd.read_csv(results / "tables" / "rdf_errors.csv", dtype={"slurry": str})
    pairs = {slurry: set(rows.pair) for slurry, rows in errors.groupby("slurry")}
    assert pairs == {"1": {"all", "NiO-8YSZ"}, "2": {"all", "NiO-8YSZ"}, "3": {"all"}}


def test_another_recipe_is_outside_the_training_range(results):
    table = pd.read_csv(results / "tables" / "training_range.csv", dtype={"slurry": str})
    outside = table[table.outside == "yes"].groupby("slurry").quantity.agg(set)
    assert {"fraction_GDC", "fraction_8YSZ"} <= outside["3"]
    assert not any(name.startswith("fraction") for slurry in "12" for name in outside.get(slurry, set()))


def test_the_report_shows_each_recipe(results):
    page = Page((results / "report.html").read_text())
    recipes = [row[:2] for row in page.rows if row[:1] in (["default"], ["binder"], ["ceria"])]
    expected = {"default": ["BDPD", "NiO", "8YSZ"], "binder": ["BDPD", "NiO", "8YSZ"], "ceria": ["BDPD", "NiO", "GDC"]}
    assert recipes == [[name, phase] for name, phases in expected.items() for phase in phases]
