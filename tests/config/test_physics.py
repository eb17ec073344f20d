"""Earlier DEM results: which changes of the configuration they refuse."""

import copy
import json
import re
from pathlib import Path

import pytest
import yaml

from configurations import merged, nested, read_slurries
from slurrycast.config.configuration import check
from slurrycast.config.earlier_results import problems
from slurrycast.config.physics import changed_physics, physics
from slurrycast.runtime.files import write_text

pytestmark = pytest.mark.usefixtures("in_empty_project")
TABLE = Path("config/slurries.tsv")


@pytest.fixture
def run(in_empty_project, config):
    """DEM results of the shipped configuration for two of its slurries, as the workflow stores them."""
    for slurry in read_slurries(TABLE)[:2]:
        path = Path("results/demo/dem", slurry.id, "run.json")
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps({"physics": physics(config, slurry)}, sort_keys=True))
    return config


def test_what_the_dem_does_not_depend_on_may_change(run):
    free = {"executable": "/opt/lammps/lmp", "launcher": "srun", "ranks": 4}
    free |= {"max_rayleigh_share": 0.5, "max_density_drift": 0.1, "impact_speed_um_us": 0.2}
    changes = {"dem": free, "formulation": {"expected_density_g_cm3": 2.3}, "relaxation": {"steps": 10}}
    changes["surrogate"] = {"vgg16": {"epochs": 3}}
    assert check(run) == check(merged(run, changes)) == []
    TABLE.write_text(TABLE.read_text().replace("T1\ttrain", "T1\ttest"))
    assert check(run) == []


@pytest.mark.parametrize(
    ("path", "value", "difference"),
    [
        ("dem.timestep_us", 0.001, "dem.timestep_us = 0.002, the configuration has 0.001"),
        ("dem.segment_frames", 12, "dem.segment_frames = 10, the configuration has 12"),
        ("formulation.unit_mass_pg", 800, "formulation.unit_mass_pg = 773.5, the configuration has 800"),
        ("force_field.granular_hertz.friction", 0, "granular_hertz.friction = 0.015, the configuration has 0"),
        (
            "formulation.phases.BDPD.size_classes",
            [{"diameter_um": 1.2, "number_fraction": 1.0}],
            "BDPD.size_classes[0].diameter_um = 1.1, the configuration has 1.2",
        ),
    ],
)
def test_changed_physics_is_refused_in_one_line(run, path, value, difference):
    changed = merged(run, nested(path, value))
    (line,) = check(changed)
    assert line.startswith("results/demo: the DEM of slurry T1 was run with ") and difference in line
    assert line.endswith(": choose another run.name, or set run.overwrite: true to compute it anew")
    assert "more)" not in line
    assert check(merged(changed, {"run": {"overwrite": True}})) == []
    assert check(merged(changed, {"run": {"name": "other"}})) == []


def test_segments_of_a_dem_that_was_cut_off_are_not_lost_to_a_changed_setting(run):
    changed = merged(run, nested("dem.timestep_us", 0.001))
    dem = Path("results/demo/dem/T1")
    Path("results/demo/dem/T2/run.json").unlink()
    (dem / "run.json").rename(dem / "inputs.json")
    assert check(changed) == []  # nothing of it has been run
    (dem / "work").mkdir()
    (dem / "work/segment_1.json").write_text("{}")
    (line,) = check(changed)
    assert line.startswith("results/demo: the DEM of slurry T1 was run with dem.timestep_us = 0.002, the configuration")
    assert check(run) == []


def test_forces_of_a_pair(run):
    """Of a run of before there were any; and in which order phases and pairs stand says nothing."""
    slurry = read_slurries(TABLE)[0]
    assert physics(run, slurry)["force_field"].keys() == {"lennard_jones", "granular_hertz"}
    assert physics(run, slurry)["dem"]["skin_um"] == 0.15
    pairs = {"NiO-BDPD": {"friction": 0.1}, "8YSZ-8YSZ": {"friction": 0.2}}
    changed = merged(run, {"force_field": {"pairs": pairs}})
    (line,) = check(changed)
    assert "without force_field.pairs.8YSZ-8YSZ.friction, the configuration has 0.2 (and 1 more)" in line
    other = merged(run, {"force_field": {"pairs": {"8YSZ-8YSZ": {"friction": 0.2}, "BDPD-NiO": {"friction": 0.1}}}})
    assert json.dumps(physics(changed, slurry)) == json.dumps(physics(other, slurry))


def test_a_line_has_what_the_user_wrote_beside_the_value_with_solvent(run):
    """The recipe of the slurry follows from that of the tape."""
    dry = merged(run, {"drying": {"composition_is": "dry"}})
    said = r"BDPD.mass_fraction = 0.13, the configuration has 0.269\d* with solvent, written as 0.13 \(and \d more\)"
    write_text("results/demo/slurries.tsv", TABLE.read_text())
    write_text("results/demo/config.yaml", yaml.safe_dump(run))
    for lines in (check(dry), problems(dry, read_slurries(TABLE), "results/demo")):
        assert re.search(said, "\n".join(lines))
    write_text("results/demo/config.yaml", yaml.safe_dump(dry))  # as it is recorded
    assert [line for line in problems(dry, read_slurries(TABLE), "results/demo") if "made with" in line] == []
    write_text("results/demo/config.yaml", yaml.safe_dump(run))
    wet = merged(run, {"formulation": {"phases": {"NiO": {"mass_fraction": 0.51}, "8YSZ": {"mass_fraction": 0.36}}}})
    for lines in (check(wet), problems(wet, read_slurries(TABLE), "results/demo")):
        assert "NiO.mass_fraction = 0.52, the configuration has 0.51 (and" in "\n".join(lines)


def test_several_changes_are_counted_in_the_one_line(run):
    changes = {"dem": {"steps": 96000, "skin_um": 0.1}, "force_field": {"granular_hertz": {"friction": 0.1}}}
    (line,) = check(merged(run, changes))
    assert "friction = 0.015, the configuration has 0.1 (and 2 more): choose" in line


@pytest.mark.parametrize(
    ("row", "difference"),
    [
        ("T1\ttrain\t1.5\t1.0\t1001", "slurry.mass_units = 1.0, the configuration has 1.5"),
        ("T1\ttrain\t1\t1.1\t1001", "slurry.thickness_ratio = 1.0, the configuration has 1.1"),
        ("T1\ttrain\t1\t1.0\t1111", "slurry.seed = 1001, the configuration has 1111"),
    ],
)
def test_changed_slurry_row_is_refused(run, row, difference):
    TABLE.write_text(TABLE.read_text().replace("T1\ttrain\t1\t1.0\t1001", row))
    (line,) = check(run)
    assert f"the DEM of slurry T1 was run with {difference}: choose" in line


def test_renamed_and_reordered_phases_are_refused(run):
    phases = run["formulation"]["phases"]
    run["formulation"]["phases"] = dict(reversed(phases.items()))
    (line,) = check(run)
    assert 'formulation.order = ["BDPD", "NiO", "8YSZ"], the configuration has ["8YSZ", "NiO", "BDPD"]' in line
    run["analysis"]["rdf_pair"] = ["Ni", "8YSZ"]
    run["formulation"]["phases"] = {"Ni": phases["NiO"], "8YSZ": phases["8YSZ"], "BDPD": phases["BDPD"]}
    (line,) = check(run)
    assert "was run without formulation.phases.Ni.mass_fraction, the configuration has 0.52 (and " in line


def test_results_of_before_pairs_and_a_skin_by_the_recipe_are_taken_over(config):
    before = copy.deepcopy(config)
    del before["force_field"]["pairs"]
    write_text("results/demo/slurries.tsv", TABLE.read_text())
    for skin_um, lines in (
        (0.15, []),
        (0.2, ["results/demo: made with dem.skin_um = 0.2, the configuration has 0.15"]),
    ):
        before["dem"]["skin_um"] = skin_um
        write_text("results/demo/config.yaml", yaml.safe_dump(before))
        found = list(problems(config, read_slurries(TABLE), "results/demo"))
        assert [line.partition(": take")[0] for line in found] == lines


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", "null", '{"physics": '])
def test_corrupt_record_of_a_run_is_refused_in_one_line(run, text):
    Path("results/demo/dem/T2/run.json").write_text(text)
    (line,) = check(run)
    assert line.startswith("results/demo/dem/T2/run.json: does not say with which settings it was run: choose another")


def test_only_the_given_folder_is_compared(run):
    run["dem"]["skin_um"] = 0.2
    assert [len(changed_physics(run, read_slurries(TABLE), f"results/{name}")) for name in ("none", "demo")] == [0, 1]
