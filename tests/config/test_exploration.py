"""Ranges and tables of recipes: what each row becomes, and the one line of each that cannot be used."""

from pathlib import Path

import pytest

from configurations import merged, shipped
from slurrycast.config import exploration
from slurrycast.config.configuration import check, checked_points
from slurrycast.config.schema_errors import shown
from slurrycast.runtime.files import write_text

pytestmark = pytest.mark.usefixtures("in_empty_project")
HEADER = "id,confirm,mass_fraction_BDPD,mass_fraction_NiO,mass_fraction_8YSZ,size_factor_NiO\n"
ROWS = ["a,,0.13,0.52,0.35,1", "b,yes,0.12,0.53,0.35,1.2", "c,,0.14,0.51,0.35,1.1", "d,,0.13,0.5,0.37,0.9"]
ROWS += ["e,,0.13,0.51,0.36,1.3"]
INPUTS = ", ".join(exploration.inputs_allowed(shipped("explore")))


@pytest.fixture
def config() -> dict:
    """The shipped exploration with an own table of recipes."""
    return merged(shipped("explore"), {"explore": {"recipes": "own.csv"}})


def lines_of(config: dict, text: str) -> list[str]:
    """What is said of a table of recipes."""
    Path("own.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError) as error:
        checked_points(config, [])
    return error.value.lines


@pytest.mark.parametrize(
    ("name", "ends", "line"),
    [
        (
            "mass_fraction_BDPD",
            [0.3, 0.2],
            "the lowest value must be below the highest; an input that does not vary is",
        ),
        ("mass_fraction_Ni", [0.1, 0.2], "must be an input of phases BDPD, NiO, 8YSZ"),
        ("size_factor_NiO", [0, 1], "must be a number at least 0.1 and at most 10"),
        ("mass_fraction_NiO", [0.1, 1.5], "must be a number above 0 and at most 1"),
        ("density_g_cm3_NiO", [6, 600.0], "must be a number at least 0.01 and at most 30"),
        ("solvent_mass_fraction", [0.5, 1.0], "must be a number at least 0 and below 1"),
        ("size_factor_NiO", [1], "must be a list of two numbers"),
    ],
)
def test_ranges_that_cannot_be(name, ends, line):
    (found,) = check(merged(shipped("explore"), {"explore": {"ranges": {name: ends}}}))
    assert found.startswith(f"explore.ranges.{name} = {shown(ends)}: {line}")


@pytest.mark.parametrize(
    ("ranges", "line"),
    [
        ({"mass_fraction_NiO": [0.4, 0.6]}, "mass_fraction_NiO alone: must be two mass fractions or more, since all"),
        (
            {"mass_fraction_NiO": [0.4, 0.5], "mass_fraction_8YSZ": [0.2, 0.3]},
            "mass_fraction_NiO, mass_fraction_8YSZ: sum to 0.6 to 0.8: must have 0.87 in between, what the",
        ),
    ],
)
def test_mass_fractions_that_cannot_keep_their_sum(config, ranges, line):
    config["explore"] |= {"ranges": ranges}
    (found,) = check(config)
    assert found.startswith(f"explore.ranges: {line}")


def test_a_design_needs_more_points_than_inputs(config):
    config["explore"] |= {"points": 6}
    assert check(config) == []  # of a design that is not used
    config["explore"]["recipes"] = None
    (line,) = check(config)
    assert line.startswith("explore.points = 6: must be at least 7, two more than inputs of explore.ranges that vary")
    config["explore"]["points"] = 7
    assert check(config) == []


def test_properties_and_targets_are_measured(config):
    config["explore"] |= {"properties": ["shrinkage", "tortuosity_x_0.1um"], "target": {"porosity": 0.4}}
    unknown, unmeasured = check(config)
    assert unknown.startswith('explore.properties: "tortuosity_x_0.1um": must be one of density, green_density, ')
    assert unmeasured.startswith("explore.target.porosity: must be one of explore.properties, shrinkage, ")
    (line,) = check(merged(shipped("explore"), {"surrogate": {"names": ["linear_box"]}}))[-1:]
    assert line == 'surrogate.names = ["linear_box"]: must have direct, which explore uses'


def test_a_row_becomes_a_recipe_and_a_slurry(config):
    Path("own.csv").write_text(HEADER + "\n".join(ROWS), encoding="utf-8-sig")
    points = list(checked_points(config, [])[0].values())
    assert [point.slurry.id for point in points if point.is_confirmed] == ["b"]
    assert len({point.slurry.seed for point in points}) == len(ROWS)
    b = points[1]
    assert b.slurry.formulation == "b" and (b.slurry.mass_units, b.slurry.role) == (1.0, "explored")
    nio, default = (recipe["phases"]["NiO"] for recipe in (b.formulation, config["formulation"]))
    assert nio["mass_fraction"] == 0.53
    assert [size["diameter_um"] for size in nio["size_classes"]] == pytest.approx(
        [1.2 * size["diameter_um"] for size in default["size_classes"]]
    )
    assert b.formulation["phases"]["8YSZ"] == config["formulation"]["phases"]["8YSZ"]
    particles_per_pg = 1001 / 1289.4  # of the default recipe, in a run
    assert points[0].formulation["unit_mass_pg"] == pytest.approx(1000 / particles_per_pg, rel=2e-3)


def test_inputs_of_the_drying_are_those_of_the_recipe(config):
    rows = "".join(f"r{n},{0.5 + 0.02 * n}\n" for n in range(4))
    Path("own.csv").write_text("id,solvent_mass_fraction\n" + rows)
    assert [point.formulation["drying"] for point in checked_points(config, [])[0].values()] == [
        {"solvent_mass_fraction": 0.5 + 0.02 * n} for n in range(4)
    ]


@pytest.mark.parametrize(
    ("row", "line"),
    [
        ("a b,,0.13,0.52,0.35,1", "id = \"a b\": must be text of at most 50 letters, digits and '_'"),
        ("b,,0.13,0.52,0.35,1", 'id = "b": must be another one, it stands on line 3 too'),
        ("x,no,0.13,0.52,0.35,1", 'confirm = "no": must be yes or empty'),
        (
            "x,,0.13,0.52,0.3,1",
            "mass_fraction_BDPD + mass_fraction_NiO + mass_fraction_8YSZ = 0.95: must be 1 within 1e-06",
        ),
        ("x,,0.13,0.52,0.35,", 'size_factor_NiO = "": must be a number at least 0.1 and at most 10'),
        ("x,,0.13,0.52,0.35,1000", "size_factor_NiO = 1000.0: must be a number at least 0.1 and at most 10"),
        ("x,,0.13,0.52,nan,1", 'mass_fraction_8YSZ = "nan": must be a number above 0 and at most 1'),
        ("x,,0.13,0.52,0.35", "5 cells: must be 6, separated by commas"),
        (
            "x,,0.13,0.52,0.35,0.5",
            "dem.timestep_us = 0.002: 0.493 of the Rayleigh time 0.004058 us of NiO of 0.3 um: must be at most 0.0016,",
        ),
    ],
)
def test_each_bad_row_gets_one_line(config, row, line):
    (found,) = lines_of(config, HEADER + "\n".join([*ROWS, row]))
    assert found.startswith(f"own.csv line 7: {line}")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "",
            f'own.csv line 1: "nothing": must be the columns id, inputs of {INPUTS}, and where wanted confirm,',
        ),
        ("id,NiO\na,1\n", 'own.csv line 1: "NiO": must be the columns id, inputs of mass_fraction_BDPD,'),
        (HEADER.replace(",", ";"), 'own.csv line 1: "id;confirm;mass_fraction_BDPD'),
        (
            HEADER + "\n".join([*ROWS, f"logs{ROWS[0][1:]}"]),
            f'own.csv line {len(ROWS) + 2}: id = "logs": must not be logs, begin with work or end with _work',
        ),
        (
            HEADER + "\n".join(ROWS[:2]),
            "own.csv: 2 recipes that no other row repeats: must be at least 4, two more than inputs that vary freely",
        ),
        (
            HEADER + "\n".join([*ROWS, *(f"{row[0]}2{row[1:]}" for row in ROWS)]),
            "own.csv: 0 recipes that no other row repeats: must be at least 5, two more than inputs that vary",
        ),
    ],
)
def test_tables_that_cannot_be_used(config, text, line):
    (found,) = lines_of(config, text)
    assert found.startswith(line)


def test_a_table_that_is_not_there(config):
    with pytest.raises(ValueError, match=r"own\.csv: cannot be read"):
        checked_points(config, [])
    config["explore"]["recipes"] = None
    assert checked_points(config, []) == ({}, [])  # no design yet


def test_a_table_of_the_project_is_the_one_that_is_checked(config, monkeypatch, tmp_path):
    monkeypatch.setattr("slurrycast.config.slurry_table.ROOT", tmp_path / "project")
    (tmp_path / "project").mkdir()
    (tmp_path / "project/own.csv").write_text(HEADER + "\n".join(ROWS))
    points, _ = checked_points(config, [])
    assert len(points) == len(ROWS) and exploration.table_path(config).samefile(tmp_path / "project/own.csv")
    Path("own.csv").write_text(HEADER)
    assert exploration.table_path(config) == Path("own.csv")


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (
            {"drying": {"organics_density_g_cm3": 0.33}},
            "drying.organics_density_g_cm3 = 0.33: must be above 0.3303, or",
        ),
        (
            {"microstructure": {"spacing_um": 0.15}},
            "microstructure.tortuosity_spacings_um = [0.1]: slurry a may have ",
        ),
    ],
)
def test_a_point_is_dried_and_measured_whatever_the_main_job_does(config, changes, line):
    off = {"drying": {"sources": []}, "microstructure": {"tortuosity_slurries": 0}}
    config = merged(
        merged(config, off), changes | {"explore": {"properties": ["tortuosity_z_0.1um"], "particles": 10**5}}
    )
    found = lines_of(config, HEADER + "\n".join(ROWS))
    assert found[0].startswith(f"own.csv line 2: {line}")
    assert not any("or set" in each for each in found)


def test_an_edited_design_is_an_own_table(config):
    config["explore"]["recipes"] = None
    path = Path("results/explore/design.csv")
    write_text(path, HEADER + "\n".join(ROWS))
    points, lines = checked_points(config, [])
    assert (len(points), lines) == (len(ROWS), [])
    path.write_text(HEADER + "\n".join(ROWS[1:]))
    edited = "results/explore/design.csv: was edited: save it under another path, and name that in explore.recipes"
    assert checked_points(config, []) == ({}, [edited])
