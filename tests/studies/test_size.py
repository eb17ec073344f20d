"""What size changes: times and ranges made by hand, and both scripts on small made-up slurries."""

import itertools
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import plot_sizes
from pictures import check_saved, texts
from script_runs import refusal, run_script, written
from slurrycast.data.frames import Frame
from slurrycast.data.tables import read_table
from slurrycast.evaluation.size import outside_share, shrink_time_us
from structures import frame, write_store

DEM_END_EDGE_UM = 4.0
LAST_INPUT_EDGE_UM = 5.0


@pytest.mark.parametrize(
    ("time_us", "edge_um", "expected_us"),
    [
        ([0, 1, 3, 4], [8, 7, 5, 4], 2),  # 0.75 x 8 = 6 lies half way between 7 and 5
        ([0, 2], [8, 6], 2),
        ([0, 1, 2, 3], [8, 6, 7, 5], 1),  # the first crossing counts
        ([0, 1], [8, 6.1], np.nan),
    ],
)
def test_time_in_which_a_box_shrinks(time_us, edge_um, expected_us):
    found_us = shrink_time_us(np.array(time_us, dtype=float), np.array(edge_um, dtype=float))
    assert found_us == pytest.approx(expected_us, nan_ok=True)


def test_outside_share():
    lowest_um, highest_um = np.array([-1.0, -1, -2]), np.array([1.0, 1, 2])
    position_um = np.array([[1.5, 0, 0], [-1, 1, 2], [0, -1.1, 2.1], [0, 0, -1.9]])
    assert outside_share(position_um, lowest_um, highest_um) == pytest.approx(3 / 12)
    assert outside_share(position_um, position_um.min(axis=0), position_um.max(axis=0)) == 0


def cube(edge_um: float, number: int, reach_um: float) -> Frame:
    """Eight particles at the corners of a cube of `reach_um` to both sides of the centre of a box."""
    position_um = reach_um * np.array(list(itertools.product((-1, 1), repeat=3)))
    return frame(number, position_um, np.full(3, edge_um))


def dem_files(folder: Path, slurry: str, shrink_us: float, reach_um: float) -> dict:
    """Files of a slurry whose edge falls at a constant rate to 0.5 in twice the shrink time."""
    thermo, run = folder / f"{slurry}_thermo.csv", folder / f"{slurry}_run.json"
    pd.DataFrame({"time_us": [0.0, 2 * shrink_us], "lx_um": [8.0, 4.0]}).to_csv(thermo, index=False)
    run.write_text(json.dumps({"slurry": slurry, "physics": {"dem": {"barostat": "npt"}}}))
    frames = [cube(LAST_INPUT_EDGE_UM, 1, reach_um), cube(DEM_END_EDGE_UM, 2, reach_um)]
    return {
        "run_json": run,
        "thermo": thermo,
        "frames": write_store(folder / f"{slurry}.h5", frames, slurry=slurry),
    }


@pytest.fixture
def study(tmp_path) -> dict:
    """Options of compare_sizes.py for two training slurries, one validation slurry and one larger test slurry."""
    sizes = {"T1": (1.0, "train", 2.0), "T2": (2.0, "train", 2.5)}
    sizes |= {"V1": (1.0, "validation", 2.2), "6": (5.0, "test", 3)}
    files = [dem_files(tmp_path, slurry, 10 * mass**0.3, reach_um) for slurry, (mass, _, reach_um) in sizes.items()]
    known = pd.DataFrame({name: size[:2] for name, size in sizes.items()}, index=["mass_units", "role"]).T
    known = known.rename_axis("slurry").assign(thickness_ratio=2.0, particles=100 * known.mass_units, warning="")
    known.to_csv(tmp_path / "equilibrium.csv")
    structures = {"predicted": [], "relaxed": []}
    # The predicted box is 0.9 of the DEM's edge; coordinates stand for 0.8 of the last input box, the DEM's end.
    for slurry in ("V1", "6"):
        for stage, share in (("predicted", 0.9), ("relaxed", 1.1)):
            structure = cube(share * DEM_END_EDGE_UM, 2, 0.8 * sizes[slurry][2])
            path = write_store(tmp_path / f"{stage}_{slurry}.h5", [structure], slurry=slurry, surrogate="affine")
            structures[stage].append(path)
    return {
        **{name: [of_slurry[name] for of_slurry in files] for name in files[0]},
        **structures,
        "equilibrium": tmp_path / "equilibrium.csv",
        "last_input_frame": 1,
        "target_frame": 2,
        "table": tmp_path / "size_errors.csv",
        "clock": tmp_path / "size_clock.csv",
    }


def test_tables(study):
    table, clock = written("compare_sizes", **study), read_table(study["clock"])
    known = ["surrogate", "slurry", "role", "mass_units", "thickness_ratio", "particles", "barostat"]
    measured = ["shrink_time_us", "last_input_density_g_cm3", "outside_share"]
    errors_of = [f"{name}_volume_error" for name in ("predicted", "relaxed", "coordinate")]
    assert list(table.columns) == known + measured + errors_of
    assert table.slurry.to_list() == ["V1", "6"]
    assert table.role.to_list() == ["validation", "test"]
    assert table.particles.to_list() == [100, 500]
    assert table.barostat.to_list() == ["npt", "npt"]
    np.testing.assert_allclose(table.shrink_time_us, [10, 10 * 5**0.3], rtol=1e-5)
    np.testing.assert_allclose(table.last_input_density_g_cm3, 16 / LAST_INPUT_EDGE_UM**3)
    assert table.outside_share.to_list() == [0, 1]  # 2.2 um is within the 2.5 um of T2, 3 um is not
    np.testing.assert_allclose(table.predicted_volume_error, 0.9**3 - 1)
    np.testing.assert_allclose(table.relaxed_volume_error, 1.1**3 - 1)
    np.testing.assert_allclose(table.coordinate_volume_error, 0, atol=1e-9)
    assert clock.columns.to_list() == ["barostat", "slurries", "exponent", "standard_error"]
    np.testing.assert_allclose(clock.iloc[0, 1:].astype(float), [4, 0.3, 0], atol=1e-6)


def test_slurry_that_does_not_shrink_is_left_out(study):
    pd.DataFrame({"time_us": [0.0, 9], "lx_um": [8.0, 7.0]}).to_csv(study["thermo"][3], index=False)
    assert written("compare_sizes", **study).shrink_time_us.isna().to_list() == [False, True]
    np.testing.assert_allclose(read_table(study["clock"]).iloc[0, 1:].astype(float), [3, 0.3, 0], atol=1e-6)


@pytest.mark.parametrize(
    ("name", "part", "message"),
    [
        ("frames", slice(2, 4), "no slurry of role train"),
        ("frames", slice(0, 3), "slurry 6: no --frames and --run-json of it"),
        ("relaxed", slice(None, None, -1), "not the particles of"),
    ],
)
def test_bad_input(study, name, part, message):
    said = refusal("compare_sizes", **study | {name: study[name][part]})
    assert said.startswith("error: ")
    assert message in said


def errors(scale: float) -> pd.DataFrame:
    """Two surrogates on four slurries."""
    slurries = pd.DataFrame({"particles": [355, 355, 1775, 1775], "thickness_ratio": [1.0, 3.5, 1.0, 3.5]})
    volume_errors = {"affine": [0.0, 0.02, 0.01, 0.0], "vgg16": [-0.1, -0.12, 0.08, 0.1]}
    tables = [
        slurries.assign(surrogate=label, predicted_volume_error=scale * np.array(values))
        for label, values in volume_errors.items()
    ]
    return pd.concat(tables)


def test_figure(tmp_path):
    figure = plot_sizes.draw_sizes({"size": errors(1.0), "size_berendsen": errors(0.5)})
    assert [axes.get_title() for axes in figure.axes] == ["size", "size_berendsen"]
    for axes, scale in zip(figure.axes, (1.0, 0.5), strict=True):
        dots = np.concatenate([line.get_ydata() for line in axes.lines if line.get_marker() in plot_sizes.MARKERS])
        assert sorted(dots) == pytest.approx(sorted(100 * scale * errors(1.0).predicted_volume_error))
        levels = [line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == "--"]
        assert levels == pytest.approx([100 * (16443 / 20390 - 1)])
    assert texts(figure.legends[0].get_texts()) == [
        *("affine", "vgg16", "thickness ratio 1", "thickness ratio 3.5", "reference article, slurry 6: −19 %"),
    ]
    check_saved(figure, tmp_path / "sizes.png")


def test_figure_of_one_run(tmp_path):
    errors(1.0).to_csv(tmp_path / "a=b.csv", index=False)
    tables, figure = [f"size={tmp_path / 'a=b.csv'}"], tmp_path / "sizes.png"
    assert run_script("plot_sizes", tables=tables, figure=figure).returncode == 0
    assert figure.stat().st_size > 10_000
    said = run_script("plot_sizes", tables=tables * 2, figure=figure).stderr
    assert said == "error: --tables: the names size, size must differ\n"
