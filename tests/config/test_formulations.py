"""Several recipes in one configuration: what holds for which slurry, and lines for what is wrong in one of them."""

import copy
import json
from pathlib import Path

import pytest

from configurations import ROOT, load, merged
from slurrycast.config import configuration
from slurrycast.config.formulations import (
    EXPECTED_PACKING_FRACTION,
    all_phases,
    expected_density_g_cm3,
    of_recipe,
    wet_recipes,
)
from slurrycast.config.physics import physics
from slurrycast.config.slurry_table import Slurry, read_slurry_table

HEADER = "id\trole\tmass_units\tthickness_ratio\tseed\tformulation\n"
ROWS = "T1\ttrain\t1\t1.0\t1\t\nT2\ttrain\t1\t1.0\t2\tcoarse\n1\ttest\t1\t1.0\t3\tcoarse\n2\ttest\t1\t1.0\t4\t\n"


def phase(mass_fraction: float, density_g_cm3: float, diameter_um: float) -> dict:
    classes = [{"diameter_um": diameter_um, "number_fraction": 1.0}]
    return {"mass_fraction": mass_fraction, "density_g_cm3": density_g_cm3, "size_classes": classes}


PHASES = {"GDC": phase(0.35, 7.2, 0.7), "NiO": phase(0.52, 6.67, 1.4), "BDPD": phase(0.13, 0.8135, 1.1)}
COARSE = {"phases": PHASES, "expected_density_g_cm3": 2.4, "unit_mass_pg": 2000.0}


@pytest.fixture
def config(tmp_path) -> dict:
    table = tmp_path / "s.tsv"
    table.write_text(HEADER + ROWS)
    return merged(load("config"), {"slurries": str(table), "formulations": {"coarse": COARSE}})


def rows(config: dict, text: str) -> dict:
    Path(config["slurries"]).write_text(HEADER + text)
    return config


def test_a_recipe_holds_what_differs(config):
    config["formulations"]["coarse"]["force_field"] = {"granular_hertz": {"friction": 0.1}}
    config["formulations"]["coarse"]["drying"] = {"solvent_mass_fraction": 0.5}
    recipe = of_recipe(config, "coarse")
    assert recipe["formulation"] == config["formulation"] | COARSE | {"phases": PHASES}
    contact = config["force_field"]["granular_hertz"]
    assert recipe["force_field"] == config["force_field"] | {"granular_hertz": contact | {"friction": 0.1}}
    assert recipe["drying"] == config["drying"] | {"solvent_mass_fraction": 0.5}
    assert of_recipe(config, "") == config and contact["friction"] == 0.015
    assert all_phases(config) == ["BDPD", "NiO", "8YSZ", "GDC"]


def test_phases_of_all_recipes_stand_in_one_order(config):
    """A pair has the same name in each, whatever the order in the file."""
    config["formulations"]["backwards"] = {"phases": dict(reversed(config["formulation"]["phases"].items()))}
    orders = [list(of_recipe(wet_recipes(config), name)["formulation"]["phases"]) for name in ("", "backwards")]
    assert orders[0] == orders[1] == ["BDPD", "NiO", "8YSZ"]


def test_the_dem_of_a_slurry_is_that_of_its_recipe(config):
    assert configuration.check(config) == []
    of_row = {slurry.id: physics(config, slurry) for slurry in configuration.checked_slurries(config)}
    alone = merged(load("config"), {"formulation": COARSE})
    alone["formulation"]["phases"] = PHASES
    for id, expected in (("1", alone), ("2", load("config"))):
        formulation = {key: value for key, value in expected["formulation"].items() if key != "expected_density_g_cm3"}
        assert of_row[id]["formulation"] == formulation | {"order": list(formulation["phases"])}


def test_a_recipe_more_changes_nothing_of_the_others(config):
    """Neither what their DEM depends on, nor the numbers of their phases: results remain those of the configuration."""
    slurry = Slurry("2", "test", 1, 1.0, 4)
    assert physics(config, slurry) == physics(load("config") | {"formulations": {}}, slurry)


def test_forces_of_pairs_and_the_skin_are_those_of_the_recipe(config):
    """Pairs of phases that a recipe lacks are no matter of its own."""
    config["force_field"]["pairs"] = {"8YSZ-8YSZ": {"friction": 0.1}, "NiO-BDPD": {"friction": 0.2}}
    config["formulations"]["coarse"]["force_field"] = {"pairs": {"NiO-GDC": {"friction": 0.3}}}
    assert configuration.check(config) == []
    of_row = {slurry.id: physics(config, slurry) for slurry in configuration.checked_slurries(config)}
    assert of_row["1"]["force_field"]["pairs"] == {"BDPD-NiO": {"friction": 0.2}, "GDC-NiO": {"friction": 0.3}}
    assert of_row["2"]["force_field"]["pairs"] == {"8YSZ-8YSZ": {"friction": 0.1}, "BDPD-NiO": {"friction": 0.2}}
    assert [of_row[id]["dem"]["skin_um"] for id in ("1", "2")] == pytest.approx([0.21, 0.15])


def test_a_dry_composition_is_that_of_each_recipe(config):
    """As two configurations of one recipe each say, and once: a second time changes nothing."""
    changes = {"composition_is": "dry", "solvent_mass_fraction": 0.2, "solvent_fraction_of": "slurry"}
    config["formulations"]["coarse"] |= {"drying": changes, "expected_density_g_cm3": 1.4}
    wet = wet_recipes(config)
    alone = of_recipe(config, "coarse") | {"formulations": {}}
    expected = wet_recipes(alone)
    recipe = of_recipe(wet, "coarse")
    assert recipe["formulation"] == expected["formulation"] != of_recipe(config, "coarse")["formulation"]
    assert recipe["drying"] == expected["drying"]
    assert wet["formulation"] == config["formulation"] and wet["drying"] == config["drying"]
    assert wet_recipes(wet) == wet
    assert configuration.check(wet) == []  # it can be written to a file and used


def test_a_wet_recipe_beside_a_dry_default_keeps_what_is_written(config):
    """What it takes from the default is as written there, and not as it was converted."""
    config["drying"] |= {"composition_is": "dry", "solvent_fraction_of": "slurry", "solvent_mass_fraction": 0.08}
    config["formulations"] = {
        "as_slurry": {"drying": {"composition_is": "wet"}},
        "own": {"phases": PHASES, "drying": {"composition_is": "wet", "solvent_fraction_of": "phase"}},
    }
    wet = wet_recipes(config)
    assert of_recipe(wet, "as_slurry")["formulation"] == config["formulation"]
    assert of_recipe(wet, "own")["formulation"]["phases"] == PHASES
    assert of_recipe(wet, "own")["drying"]["solvent_mass_fraction"] == 0.08
    assert wet["formulation"] != config["formulation"]


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (
            {"phases": PHASES | {"NiO": phase(0.6, 6.67, 1.4)}},
            "formulations.coarse: formulation.phases: mass fractions sum to 1.08: must be 1 within 1e-06",
        ),
        ({"density": 2.4}, "formulations.coarse.density: unknown key: must be one of unit_mass_pg, "),
        ({"force_field": {"granular_hertz": {"friction": -1}}}, "formulations.coarse.force_field.granular_hertz.frict"),
        (
            {"force_field": {"lennard_jones": {"sigma_factor": 2.0}}},
            "formulations.coarse: force_field.lennard_jones.si",
        ),
        ({"drying": {"solvent_mass_fraction": 0.05}}, "formulations.coarse: drying.solvent_mass_fraction = 0.05: the"),
        (
            {"expected_density_g_cm3": 7.0},
            "formulations.coarse: formulation.expected_density_g_cm3 = 7.0: must be below",
        ),
        (
            {"force_field": {"pairs": {"NiO-YSZ": {"friction": 0.1}}}},
            "formulations.coarse: force_field.pairs.NiO-YSZ: must be two phases of BDPD, NiO, 8YSZ, GDC with",
        ),
        ({"unit_mass_pg": 20.0}, "formulations.coarse: formulation.unit_mass_pg: slurry "),
    ],
)
def test_what_is_wrong_in_a_recipe_is_said_with_its_name(config, changes, line):
    config["formulations"]["coarse"] |= changes
    found = configuration.check(config)
    assert any(each.startswith(line) for each in found), found
    assert all(each.startswith("formulations.coarse") for each in found)


def test_a_fault_of_two_recipes_is_said_of_both_and_one_of_the_default_once(config):
    config["formulations"]["coarse"]["expected_density_g_cm3"] = 7.0
    config["formulations"]["other"] = copy.deepcopy(config["formulations"]["coarse"])
    both = configuration.check(config)
    assert [line.partition(":")[0] for line in both] == ["formulations.coarse", "formulations.other"]
    config["formulation"]["initial_packing_fraction"] = 0.9
    packing = [line for line in configuration.check(config) if "initial_packing_fraction" in line]
    assert len(packing) == 1 and packing[0].startswith("formulation.")


def test_a_wrong_name_of_a_recipe(config):
    (line,) = configuration.check(rows(config, ROWS + "3\ttest\t1\t1.0\t5\tcorase\n"))
    assert line.endswith('slurry 3: formulation = "corase": must be one of coarse, or empty')
    config["formulations"] = {}
    found = configuration.check(config)
    assert found[0].endswith('slurry T2: formulation = "coarse": must be empty, as formulations has no recipe')


def test_phases_of_the_rdf_may_be_of_any_recipe(config):
    config["analysis"]["rdf_pair"] = ["GDC", "NiO"]
    assert configuration.check(config) == []
    config["analysis"]["rdf_pair"] = ["GDC", "YSZ"]
    (line,) = configuration.check(config)
    assert line.endswith("must be two phases of BDPD, NiO, 8YSZ, GDC, which may be the same")


def test_a_recipe_without_training_slurries_needs_direct(config):
    rows(config, ROWS.replace("T2\ttrain\t1\t1.0\t2\tcoarse\n", ""))
    assert configuration.check(config) == []
    config["surrogate"]["names"].remove("direct")
    config["drying"]["sources"] = ["dem"]
    (line,) = configuration.check(config)
    assert line == (
        "surrogate.names: affine needs a packing fraction, and slurry 1 is of formulation coarse, which has no "
        "training slurry: must hold direct too, which finds one"
    )
    config["surrogate"]["packing_fraction"] = 0.66
    assert configuration.check(config) == []
    rows(config, ROWS.replace("T1\ttrain\t1\t1.0\t1\t\n", ""))
    config["surrogate"]["packing_fraction"] = None
    (line,) = configuration.check(config)
    assert "slurry 2 is of the default formulation, which has no training slurry" in line


def test_the_column_may_be_left_out(tmp_path):
    path = tmp_path / "s.tsv"
    path.write_text(HEADER.replace("\tformulation", "") + "T1\ttrain\t1\t1.0\t1\n")
    assert [slurry.formulation for slurry in read_slurry_table(path)[0]] == [""]


def test_an_expected_density_that_is_not_given(config):
    """That of the particles at the packing fraction of the reference run; phases alone do not take that of others."""
    measured = json.loads((ROOT / "results" / "reference" / "reduced" / "packing_fraction.json").read_text())["mean"]
    assert pytest.approx(measured, abs=5e-4) == EXPECTED_PACKING_FRACTION
    del config["formulations"]["coarse"]["expected_density_g_cm3"]
    formulation = of_recipe(config, "coarse")["formulation"]
    assert formulation["expected_density_g_cm3"] is None
    volume_of_1_pg_um3 = 0.35 / 7.2 + 0.52 / 6.67 + 0.13 / 0.8135
    expected = EXPECTED_PACKING_FRACTION / volume_of_1_pg_um3
    assert expected_density_g_cm3(formulation) == pytest.approx(expected)
    assert expected_density_g_cm3(config["formulation"]) == 2.24
    assert configuration.check(config) == []


def test_a_phase_that_is_not_whole_is_said_to_replace_the_shipped_one(config):
    config["formulation"]["phases"] = {"NiO": {"mass_fraction": 0.5}}
    line = configuration.check(config)[0]
    assert line.endswith("(phases replace those of config.yaml, so each is written whole)")
