"""What size changes: times and ranges made by hand, and both scripts on small made-up slurries."""

import itertools
import json
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

import plot_sizes
from slurrycast.data.frames import Frame
from slurrycast.data.tables import read_table
from slurrycast.evaluation.size import outside_share, shrink_time_us
from slurrycast.report.figures import save_figure
from structures import frame, write_store

DEM_END_EDGE_UM = 4.0
LAST_INPUT_EDGE_UM = 5.0


def test_crossing_is_interpolated():
    # 0.75 x 8 = 6 lies half way between 7 and 5
    assert shrink_time_us(np.array([0.0, 1, 3, 4]), np.array([8.0, 7, 5, 4])) == pytest.approx(2.0)
    assert shrink_time_us(np.array([0.0, 2]), np.array([8.0, 6])) == pytest.approx(2.0)


def test_first_crossing_counts():
    assert shrink_time_us(np.array([0.0, 1, 2, 3]), np.array([8.0, 6, 7, 5])) == pytest.approx(1.0)


def test_no_crossing():
    assert np.isnan(shrink_time_us(np.array([0.0, 1]), np.array([8.0, 6.1])))


def test_outside_share():
    lowest_um, highest_um = np.array([-1.0, -1, -2]), np.array([1.0, 1, 2])
    position_um = np.array([[1.5, 0, 0], [-1, 1, 2], [0, -1.1, 2.1], [0, 0, -1.9]])
    assert outside_share(position_um, lowest_um, highest_um) == pytest.approx(3 / 12)
    assert outside_share(position_um, position_um.min(axis=0), position_um.max(axis=0)) == 0


def cube(edge_um: float, number: int, reach_um: float) -> Frame:
    """Eight particles at the corners of a cube of `reach_um` to both sides of the centre of a box."""
    position_um = reach_um * np.array(list(itertools.product((-1, 1), repeat=3)))
    return frame(number, position_um, np.full(3, edge_um))


def dem_files(folder: Path, slurry: str, mass: float, shrink_us: float, damping_us: float, reach_um: float) -> dict:
    """Files of a slurry whose edge falls at a constant rate to 0.5 in twice the shrink time."""
    thermo, run = folder / f"{slurry}_thermo.csv", folder / f"{slurry}_run.json"
    pd.DataFrame({"time_us": [0.0, 2 * shrink_us], "lx_um": [8.0, 4.0]}).to_csv(thermo, index=False)
    run.write_text(json.dumps({"slurry": slurry, "physics": {"dem": {"pressure_damping_us": damping_us}}}))
    frames = [cube(LAST_INPUT_EDGE_UM, 1, reach_um), cube(DEM_END_EDGE_UM, 2, reach_um)]
    return {
        "run_json": run,
        "thermo": thermo,
        "frames": write_store(folder / f"{slurry}.h5", frames, slurry=slurry),
    }


@pytest.fixture
def study(tmp_path) -> dict:
    """Options of compare_sizes.py for two training slurries, one validation slurry and one larger test slurry."""
    sizes = {
        "T1": (1.0, "train", 2.0),
        "T2": (2.0, "train", 2.5),
        "V1": (1.0, "validation", 2.2),
        "6": (5.0, "test", 3),
    }
    files = [
        dem_files(tmp_path, slurry, mass, 10 * mass**0.3, 1e4 * mass**-0.2, reach_um)
        for slurry, (mass, _, reach_um) in sizes.items()
    ]
    known = {"slurry": list(sizes), "role": [size[1] for size in sizes.values()]}
    known["mass_units"] = [size[0] for size in sizes.values()]
    known |= {"thickness_ratio": 2.0, "particles": [round(100 * mass) for mass in known["mass_units"]], "warning": ""}
    pd.DataFrame(known).to_csv(tmp_path / "equilibrium.csv", index=False)
    structures = {"predicted": [], "relaxed": []}
    # The predicted box is 0.9 of the DEM's edge; coordinates stand for 0.8 of the last input box, the DEM's end.
    for surrogate, slurry in (("affine", "V1"), ("affine", "6")):
        reach_um = 0.8 * sizes[slurry][2]
        for stage, edge_um in (("predicted", 0.9 * DEM_END_EDGE_UM), ("relaxed", 1.1 * DEM_END_EDGE_UM)):
            path = tmp_path / f"{stage}_{slurry}.h5"
            structures[stage].append(
                write_store(path, [cube(edge_um, 2, reach_um)], slurry=slurry, surrogate=surrogate)
            )
    return {
        **{name: [of_slurry[name] for of_slurry in files] for name in files[0]},
        **structures,
        "equilibrium": tmp_path / "equilibrium.csv",
        "last_input_frame": 1,
        "target_frame": 2,
        "table": tmp_path / "size_errors.csv",
        "clock": tmp_path / "size_clock.csv",
    }


def test_tables(study, command):
    subprocess.run(command("compare_sizes", **study), check=True)
    table, clock = read_table(study["table"]), read_table(study["clock"])
    assert list(table.columns) == [
        *("surrogate", "slurry", "role", "mass_units", "thickness_ratio", "particles", "pressure_damping_us"),
        *("shrink_time_us", "last_input_density_g_cm3", "outside_share", "predicted_volume_error"),
        *("relaxed_volume_error", "coordinate_volume_error"),
    ]
    assert table.slurry.to_list() == ["V1", "6"]
    assert table.role.to_list() == ["validation", "test"]
    assert table.particles.to_list() == [100, 500]
    np.testing.assert_allclose(table.pressure_damping_us, [1e4, 1e4 * 5**-0.2], rtol=1e-5)
    np.testing.assert_allclose(table.shrink_time_us, [10, 10 * 5**0.3], rtol=1e-5)
    np.testing.assert_allclose(table.last_input_density_g_cm3, 16 / LAST_INPUT_EDGE_UM**3)
    assert table.outside_share.to_list() == [0, 1]  # 2.2 um is within the 2.5 um of T2, 3 um is not
    np.testing.assert_allclose(table.predicted_volume_error, 0.9**3 - 1)
    np.testing.assert_allclose(table.relaxed_volume_error, 1.1**3 - 1)
    np.testing.assert_allclose(table.coordinate_volume_error, 0, atol=1e-9)
    assert clock.columns.to_list() == ["slurries", "exponent", "standard_error", "damping_exponent"]
    np.testing.assert_allclose(clock.iloc[0], [4, 0.3, 0, -0.2], atol=1e-6)


def test_slurry_that_does_not_shrink_is_left_out(study, command):
    pd.DataFrame({"time_us": [0.0, 9], "lx_um": [8.0, 7.0]}).to_csv(study["thermo"][3], index=False)
    subprocess.run(command("compare_sizes", **study), check=True)
    assert read_table(study["table"]).shrink_time_us.isna().to_list() == [False, True]
    np.testing.assert_allclose(read_table(study["clock"]).iloc[0], [3, 0.3, 0, -0.2], atol=1e-6)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"frames": slice(2, 4)}, "no slurry of role train"),
        ({"frames": slice(0, 3)}, "slurry 6: no --frames and --run-json of it"),
        ({"relaxed": slice(None, None, -1)}, "not the slurry of"),
    ],
)
def test_bad_input(study, command, changes, message):
    for name, part in changes.items():
        study[name] = study[name][part]
    result = subprocess.run(command("compare_sizes", **study), capture_output=True, text=True)
    assert result.returncode == 1
    assert result.stderr.startswith("error: ")
    assert message in result.stderr
    assert not study["table"].exists()


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
    figure = plot_sizes.draw_sizes({"size": errors(1.0), "size_clock": errors(0.5)})
    assert [axes.get_title() for axes in figure.axes] == ["size", "size_clock"]
    for axes, scale in zip(figure.axes, (1.0, 0.5), strict=True):
        dots = np.concatenate([line.get_ydata() for line in axes.lines if line.get_marker() in plot_sizes.MARKERS])
        assert sorted(dots) == pytest.approx(sorted(100 * scale * errors(1.0).predicted_volume_error))
        levels = [line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == "--"]
        assert levels == pytest.approx([100 * (16443 / 20390 - 1)])
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        *("affine", "vgg16", "thickness ratio 1", "thickness ratio 3.5", "reference article, slurry 6: −19 %"),
    ]
    save_figure(figure, tmp_path / "sizes.png")
    assert np.mean(np.any(imread(tmp_path / "sizes.png")[..., :3] < 0.9, axis=-1)) > 0.01


def test_figure_of_one_run(command, tmp_path):
    errors(1.0).to_csv(tmp_path / "a=b.csv", index=False)
    figure = tmp_path / "sizes.png"
    subprocess.run(command("plot_sizes", tables=[f"size={tmp_path / 'a=b.csv'}"], figure=figure), check=True)
    assert figure.stat().st_size > 10_000
    twice = [f"size={tmp_path / 'a=b.csv'}"] * 2
    result = subprocess.run(command("plot_sizes", tables=twice, figure=figure), capture_output=True, text=True)
    assert result.stderr == "error: --tables: the names size, size must differ\n"
