"""Tables of tapes on cases with a known answer, and the figure of the drying."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import plot_drying
import plot_tape
from script_runs import run_script, written
from slurrycast.report import tape_statistics
from slurrycast.report.names import tape_quantity
from slurrycast.report.page import environment

PARTICLES = {"1": 1000, "2": 4000, "3": 1000, "N": 500}


def microstructure(path, source, slurry, **values):
    """Write a table as measure_microstructure does."""
    particles = PARTICLES[slurry.split("_")[0]]
    names = {"source": source, "slurry": slurry, "stage": "tape"}
    rows = [names | {"quantity": "particles", "value": particles, "unit": "1"}]
    units = {"green_density": "g/cm3"}
    rows += [names | {"quantity": name, "value": value, "unit": units.get(name, "1")} for name, value in values.items()]
    pd.DataFrame(rows).to_csv(path, index=False)
    return path


def values(void, density=1.0, percolation=0.9):
    """Judged quantities, and one that is not."""
    return {"share_void_union": void, "green_density": density, "percolation_NiO_x": percolation}


@pytest.fixture
def tabulated(tmp_path):
    """A function that makes tables/microstructure.csv with a number of replicas of slurry 1.

    `far` is off by 10 sd in the void and not at all in density; slurry N has no DEM.
    """
    paths = []
    for slurry, void, off in (("1", 5.0, 1.0), ("2", 6.0, 0.5), ("3", 7.0, 1.1)):
        paths.append(microstructure(tmp_path / f"dem_{slurry}.csv", "dem", slurry, **values(void)))
        paths.append(microstructure(tmp_path / f"far_{slurry}.csv", "far", slurry, **values(void + off)))
    paths.append(microstructure(tmp_path / "far_N.csv", "far", "N", **values(1.0)))
    table = tmp_path / "microstructure.csv"

    def tabulated(number: int) -> pd.DataFrame:
        replicas = [
            microstructure(
                tmp_path / f"r{k}.csv", "dem", f"1_r{k}", **values(5 + 0.1 * k, 1 + 0.01 * k, 0.9 + 0.01 * k)
            )
            for k in range(1, number + 1)
        ]
        return written("tabulate_microstructure", microstructures=paths, replicas=replicas, table=table)

    return tabulated


@pytest.fixture
def judged(tabulated, tmp_path):
    """tables/tape_errors.csv and tape_verdicts.csv."""
    errors = tabulated(3)
    options = {"tape_errors": tmp_path / "microstructure.csv", "table": tmp_path / "tape_verdicts.csv"}
    return errors, written("judge_tapes", slurries=["1", "2", "3"], **options)


def section(page, name, **shared):
    """Text of one section of a page, its white space made even."""
    return " ".join(str(environment().get_template(f"{page}/{name}.html.jinja").make_module(shared)).split())


def test_every_tape_stands_beside_that_of_the_dem_and_its_scatter(tabulated):
    """The scatter falls with particles^-1/2; without replicas it is not known, nor is that of the other stage."""
    rows = tabulated(3)
    assert list(rows) == ["source", "slurry", "stage", "quantity", "value", "unit", "dem_value", "replica_sd"]
    assert set(rows.slurry) == {"1", "2", "3", "N"}
    rows = rows.set_index(["source", "slurry", "quantity"])
    assert rows.dem_value["far", "2", "share_void_union"] == rows.dem_value["dem", "2", "share_void_union"] == 6.0
    assert np.isnan(rows.dem_value["far", "N", "share_void_union"])
    sd = rows.replica_sd.xs("share_void_union", level="quantity")
    assert sd["dem", "1"] == pytest.approx(0.1) and sd["far", "2"] == pytest.approx(0.05)
    assert sd["far", "N"] == pytest.approx(0.1 * 2**0.5)
    assert tabulated(0).replica_sd.isna().all() and tabulated(1).replica_sd.isna().all()


def test_stages_scatter_by_themselves(tmp_path):
    """Each quantity beside the replicas in the same stage; one that these do not have has no scatter."""
    paths = {}
    for name, slurry, off in (("dem", "1", 0.0), ("r1", "1_r1", 0.1), ("r2", "1_r2", -0.1)):
        of_tape = pd.read_csv(microstructure(tmp_path / f"{name}.csv", "dem", slurry, void=5.0 + off), dtype=str)
        of_slurry = of_tape.assign(stage="slurry", value=[1000, 3.0 + 2 * off])
        rows = [of_tape, of_slurry, *([of_slurry[1:].assign(quantity="pores")] if name == "dem" else [])]
        paths[name] = tmp_path / f"{name}.csv"
        pd.concat(rows).to_csv(paths[name], index=False)
    options = {"microstructures": [paths["dem"]], "replicas": [paths["r1"], paths["r2"]]}
    rows = written("tabulate_microstructure", **options, table=tmp_path / "table.csv")
    sd = rows.set_index(["stage", "quantity"]).replica_sd
    assert sd["tape", "void"] == pytest.approx(0.1 * 2**0.5) and sd["slurry", "void"] == pytest.approx(0.2 * 2**0.5)
    assert np.isnan(sd["slurry", "pores"])


def test_only_replicas_that_have_a_quantity_count(tmp_path):
    """Pooled with their degrees of freedom, one of slurry 1 and one of slurry 2, which has twice the particles."""
    voids = {"1_r1": 5.0, "1_r2": 5.2, "1_r3": np.nan, "2_r1": 6.0, "2_r2": 6.4}
    replicas = [microstructure(tmp_path / f"{name}.csv", "dem", name, void=void) for name, void in voids.items()]
    tape = microstructure(tmp_path / "1.csv", "dem", "1", void=5.0)
    table = tmp_path / "table.csv"
    rows = written("tabulate_microstructure", microstructures=[tape], replicas=replicas, table=table)
    n = PARTICLES["2"] / PARTICLES["1"]
    expected = ((0.2**2 / 2 + n * 0.4**2 / 2) / 2) ** 0.5
    assert rows.set_index("quantity").replica_sd["void"] == pytest.approx(expected)


def test_tapes_are_judged_by_the_scatter_of_replicas(judged):
    _, verdicts = judged
    assert set(verdicts.surrogate) == {"far"} and set(verdicts.slurries) == {3}
    verdict = verdicts.set_index("measure").verdict
    assert dict(verdict) == {"share_void_union": "differs", "green_density": "equivalent"}


def test_report_says_whether_the_tapes_are_those_of_the_dem(judged, tabulated):
    """By the verdicts of the evaluation, on the tapes and replicas of the main job."""
    rows, verdicts = judged
    ends = {"friction": [12.5, 0.015], "green_density_g_cm3": [2.8, 3.3], "packing_fraction": [0.57, 0.66]}
    tables = {"microstructure": rows, "drying_calibration": pd.DataFrame(ends)}
    config = {"drying": {"green_density_g_cm3": None, "force_field": {"friction": 0.5}, "replicas": 3}}
    shared = {"config": config, "figures": {}}
    found = tape_statistics.tapes(SimpleNamespace(**tables, test=["1", "2", "3"]))
    assert found["counts"] == {"far": {"judged": 2, "equivalent": 1, "different": ["void"]}}
    density, void = found["rows"]
    assert density == ["green density (g/cm³)", 1.0, 1.0, pytest.approx(0.025 / 3), 0.0, 0.0, "equivalent"]
    assert void[1:5] == pytest.approx([6.0, 6.0 + 2.6 / 3, 0.25 / 3, 2.6 / 3])
    assert void[-1] == verdicts.set_index("measure").verdict["share_void_union"] == "differs"
    text = section("report", "tape", **shared, **found)
    assert "like those of the DEM in 1 of 2 properties with far (different in void); the rest" in text
    assert "tapes of 3 DEM runs of one small slurry" in text
    assert "with 0.015 it has 3.30 g/cm³ and 34.0%." in text
    two = tape_statistics.tapes(SimpleNamespace(**tables, test=["1", "2"]))
    without, dem = ({"microstructure": table} for table in (tabulated(0), rows[rows.source == "dem"]))
    unknown = tape_statistics.tapes(SimpleNamespace(**tables | without, test=["1", "2", "3"]))
    alone = tape_statistics.tapes(SimpleNamespace(**tables | dem, test=["1"]))
    for none in (two, unknown):
        assert "No tape is judged: that takes 3 test slurries" in section("report", "tape", **shared, **none)
    assert alone["counts"] == {} and "judged" not in section("report", "tape", **shared, **alone)


def test_evaluation_shows_tapes_in_units_of_the_noise(judged):
    errors, verdicts = judged
    tested = errors[errors.slurry != "N"]
    evaluation = SimpleNamespace(tape_errors=errors, tape_verdicts=verdicts, tested=lambda _: tested)
    found = tape_statistics.tape_verdicts(evaluation)
    assert found["counts"] == {"far": {"judged": 2, "equivalent": 1, "different": ["void"]}}
    (void,) = (row for row in found["rows"] if row[0] == "void")
    assert void[1:4] == pytest.approx([6.0, 0.25 / 3, (10 + 10 + 11) / 3])
    page = section("evaluation", "tape", figures={}, test=["1", "2", "3"], **found)
    assert "like those of the DEM in 1 of 2 properties with far (different in void)" in page
    assert tape_statistics.tape_verdicts(SimpleNamespace(tape_verdicts=None)) is None


def test_each_tortuosity_is_shown_with_a_name_of_its_own():
    names = {
        "tortuosity_z_0.1um": "tortuosity factor of void, z, 0.1 µm voxels",
        "tortuosity_x_extrapolated": "tortuosity factor of void, x, extrapolated",
        "tortuosity_nonceramic_y_0.2um": "tortuosity factor of void and organics, y, 0.2 µm voxels",
    }
    assert tape_statistics.shown_quantities(pd.DataFrame({"quantity": list(names)})) == list(names)
    assert {quantity: tape_quantity(quantity, "1") for quantity in names} == names


DRYING = pd.DataFrame(
    {
        "solvent_left": [1, 0.5, 0, 0],
        "thickness_um": [9, 8, 7, 6],
        "density_g_cm3": [2.2, 2.5, 2.8, 3.0],
        "packing_fraction": [0.66, 0.63, 0.6, 0.62],
    }
)


def test_legends_name_the_dem():
    pores = pd.DataFrame({"diameter_um": [0.1, 0.3], "share_below": [0.1, 0.9]})
    profile = pd.DataFrame({"z_um": [1.0, 2.0], "phase": ["void", "NiO"], "share": [0.4, 0.6]})
    sources = ["dem", "direct"]
    sizes, along_z = plot_tape.draw_tape(dict.fromkeys(sources, pores), dict.fromkeys(sources, profile)).axes
    legends = [*plot_drying.draw_drying(sources, [DRYING] * 2).legends, sizes.get_legend(), along_z.get_legend()]
    shown = [[text.get_text() for text in legend.get_texts()] for legend in legends]
    assert shown == [["DEM", "direct"], ["DEM", "direct"], ["void", "NiO", "DEM", "direct"]]


def test_drying_is_drawn(tmp_path):
    DRYING.to_csv(tmp_path / "drying.csv", index=False)
    figure = tmp_path / "drying.png"
    done = run_script("plot_drying", sources=["dem", "direct"], drying=[tmp_path / "drying.csv"] * 2, figure=figure)
    assert (done.returncode, done.stderr) == (0, "")
    assert figure.stat().st_size > 5000
