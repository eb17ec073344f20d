"""Figures of cost, front and skill from small synthetic tables: they are not blank and show the right numbers."""

import numpy as np
import pandas as pd
import pytest

import plot_costs
import plot_front
import plot_skill
from pictures import check_saved, is_drawn, recorded_calls, texts
from script_runs import run_script
from slurrycast.evaluation.speedup import HYBRID_PARTS


def comparison(surrogate: str) -> pd.DataFrame:
    """Two slurries, the second one new."""
    parts = dict.fromkeys(HYBRID_PARTS, 2.0) | {"run_slurry_to_input": 10.0}
    rows = pd.DataFrame({"surrogate": surrogate, "slurry": ["1", "N1"], "clock": "wall_s"} | parts | {"hybrid": 20.0})
    return rows.assign(
        dem=[100.0, np.nan],
        dem_to_equilibrium=[60.0, np.nan],
        ratio=[5.0, np.nan],
        ratio_to_equilibrium=[3.0, np.nan],
    )


def test_costs_of_several_surrogates(tmp_path):
    figure = plot_costs.draw_costs(pd.concat([comparison("affine"), comparison("net"), comparison("linear")]))
    assert [axes.get_title() for axes in figure.axes] == ["affine", "net", "linear"]
    assert [texts(axes.texts) for axes in figure.axes] == [["5.0 × (3.0 ×)"]] * 3
    assert len({axes.get_xlim() for axes in figure.axes}) == 1
    ends = [max(bar.get_x() + bar.get_width() for bar in axes.patches) for axes in figure.axes]
    assert ends == pytest.approx([20.0] * 3)
    assert texts(figure.legends[0].get_texts()) == ["DEM to equilibrium", "full DEM", *HYBRID_PARTS.values()]
    check_saved(figure, tmp_path / "costs.png")


def test_costs_of_new_slurries_only(tmp_path):
    figure = plot_costs.draw_costs(comparison("net")[1:])
    assert texts(figure.axes[0].texts) == []
    assert texts(figure.legends[0].get_texts()) == [*HYBRID_PARTS.values()]
    check_saved(figure, tmp_path / "new.png")


def test_costs_of_an_unknown_surrogate(tmp_path):
    table, figure = tmp_path / "speedup.csv", tmp_path / "costs.png"
    comparison("net").to_csv(table, index=False)
    done = run_script("plot_costs", speedup=table, surrogates=["net", "vgg"], figure=figure)
    assert (done.returncode, figure.exists()) == (1, False)
    assert done.stderr.startswith("error: --surrogates vgg: not in")


LABELS = ["affine", "affine_f02", "early_dem_x2", "early_dem_x10_f02", "vgg16", "early_dem_x10"]


@pytest.fixture(scope="module")
def front(tmp_path_factory):
    """The figure that plot_front draws from small tables, with a validation slurry that does not count."""
    points = {
        "surrogate": LABELS,
        "input_last_frame": [10, 2, 10, 2, 10, 10],
        "cost_share_of_full_dem": [0.1, 0.05, 0.4, 0.3, 1.2, 0.35],
        "density_error": [0.004, 0.005, 0.002, 0.0045, 0.001, 0.0046],
        "rdf_error": [0.02, 0.02, 0.02, 0.01, 0.03, 0.02],
    }
    mse_um2 = [0.1, 0.13, 0.06, 0.12, 1.05, 0.09]
    test, validation = (pd.DataFrame(points | {"slurry": slurry}) for slurry in ("2", "V1"))
    validation.density_error *= 100
    roles = pd.DataFrame({"slurry": ["2", "V1"], "role": ["test", "validation"], "warning": ""})
    errors = {"surrogate": "affine", "slurry": "2", "stage": "relaxed", "quantity": ["density_g_cm3", "rdf_all"]}
    errors |= {"value": [2.0, 0.02], "dem_value": [2.0, 0.0], "replica_sd": [0.006, 0.015]}
    skill = pd.DataFrame({"surrogate": LABELS, "slurry": "2", "mse_um2": mse_um2, "mse_affine_um2": 0.1})
    tables = {
        "front": pd.concat([test, validation]),
        "skill": pd.concat([skill, skill.assign(slurry="V1", mse_um2=9.0)]),
        "equilibrium": roles,
        "structure_errors": pd.DataFrame(errors),
        "speedup": comparison("affine").assign(slurry=["2", "N1"], clock="cpu_s"),
    }
    folder = tmp_path_factory.mktemp("front")
    paths = {name: folder / f"{name}.csv" for name in tables}
    for name, table in tables.items():
        table.to_csv(paths[name], index=False)
    with pytest.MonkeyPatch.context() as patch:
        calls = recorded_calls(patch, plot_front, "draw_front")
        done = run_script(plot_front, **paths, figure=folder / "front.png")
    assert done.returncode == 0, done.stderr
    assert is_drawn(folder / "front.png")
    return calls[0][1]


def line_of(axes, label: str) -> np.ndarray:
    """Points (n, 2) of a line by its label."""
    return next(line for line in axes.lines if line.get_label() == label).get_xydata()


def rims(axes) -> list[list[float]]:
    """Points with a dark rim, in order of cost."""
    marked = [
        line
        for line in axes.lines
        if line.get_markeredgecolor() == plot_front.INK and not line.get_label()[0].isalpha()
    ]
    marked = [line.get_xydata() for line in marked if line.get_marker() != "None"]
    return sorted(point for points in marked for point in points.round(6).tolist())


def test_front_marks_those_that_are_on_it(front):
    mse, density, rdf = front.axes
    on_density = [[5, 0.5], [10, 0.4], [40, 0.2]]  # both in %
    np.testing.assert_allclose(line_of(density, "front"), on_density)
    np.testing.assert_allclose(rims(density), on_density)
    np.testing.assert_allclose(rims(rdf), [[5, 0.02], [30, 0.01]])
    np.testing.assert_allclose(rims(mse), [[5, 1.3], [10, 1.0], [35, 0.9], [40, 0.6]])
    assert set(line_of(density, "DEM to its own equilibrium")[:, 0]) == {60}
    assert [axes.get_title() for axes in (mse, density, rdf)] == [
        "Coordinates, before relaxation (numbers: last input frame)",
        "Density, after relaxation (band: 2 sd of replicas)",
        "RDF of all particles, after relaxation (band: between two replicas)",
    ]
    band = next(patch for patch in density.patches if patch.get_label() == "noise of the DEM: order not resolved")
    assert band.get_extents().transformed(density.transData.inverted()).y1 == pytest.approx(0.6)


def test_input_frames_of_a_surrogate_are_one_line_in_their_order(front):
    for axes in front.axes:
        assert line_of(axes, "affine")[:, 0] == pytest.approx([5, 10])
        assert line_of(axes, "early_dem_x10")[:, 0] == pytest.approx([30, 35])
        assert len(line_of(axes, "early_dem_x2")) == 1
        numbers = [text for text in texts(axes.texts) if text.isdigit()]
        assert sorted(numbers) == ["10", "10", "2", "2"]  # those of the two lines
    legend = texts(front.legends[0].get_texts())
    assert {"affine", "early_dem_x10", "early_dem_x2", "vgg16"} < set(legend)
    assert not any("_f02" in text for text in legend)


def test_an_error_far_beyond_the_affine_map_is_written_at_the_edge(front):
    mse, density, _ = front.axes
    assert "vgg16: 10.5" in texts(mse.texts)
    assert mse.get_ylim()[1] < 2
    assert not any("vgg16" in text for text in texts(density.texts))


def test_numbers_do_not_overlap(front):
    front.draw_without_rendering()
    for axes in front.axes:
        boxes = [text.get_window_extent() for text in axes.texts]
        assert not any(a.overlaps(b) for place, a in enumerate(boxes) for b in boxes[:place])


def test_labels_without_their_last_input_frame():
    labels = ["affine", "affine_f02", "early_dem_x10_f04", "vgg16_box"]
    assert [plot_front.plain_label(label) for label in labels] == ["affine", "affine", "early_dem_x10", "vgg16_box"]


@pytest.mark.parametrize(
    ("surrogate", "mse_of_affine", "said"), [("affine", 1.0, []), ("persistence", 9.0, ["persistence: 9.0"])]
)
def test_front_without_replicas_has_no_bands(tmp_path, surrogate, mse_of_affine, said):
    """Also where no point lies within the axis, which the affine map is on all the same."""
    columns = {"surrogate": [surrogate], "input_last_frame": [10], "cost_share_of_full_dem": [0.1]}
    points = pd.DataFrame(columns | {"mse_of_affine": [mse_of_affine], "density_error": [0.004], "rdf_error": [0.02]})
    figure = plot_front.draw_front(points, {"density_error": np.nan, "rdf_error": np.nan}, np.nan)
    assert [len(axes.patches) for axes in figure.axes] == [0, 0, 0]
    low, high = figure.axes[0].get_ylim()
    assert low < 1 < high
    assert set(said) <= set(texts(figure.axes[0].texts))
    check_saved(figure, tmp_path / "front.png")


def test_a_surrogate_without_coordinates_is_on_the_other_fronts(tmp_path):
    columns = {"surrogate": ["direct", "affine"], "input_last_frame": [0, 10], "cost_share_of_full_dem": [0.1, 0.2]}
    columns |= {"mse_of_affine": [np.nan, 1.0], "density_error": [0.001, 0.004], "rdf_error": [0.03, 0.02]}
    figure = plot_front.draw_front(pd.DataFrame(columns), {}, np.nan)
    fronts = [[[20, 1.0]], [[10, 0.1]], [[10, 0.03], [20, 0.02]]]
    for axes, expected in zip(figure.axes, fronts, strict=True):
        np.testing.assert_allclose(line_of(axes, "front"), expected)
    assert {"affine", "direct"} < set(texts(figure.legends[0].get_texts()))
    check_saved(figure, tmp_path / "front.png")


def test_skill_below_the_axis_is_written(tmp_path):
    skill = pd.DataFrame(
        [("persistence", "1", -6.54), ("persistence", "2", -0.5), ("affine", "1", 0.0), ("affine", "2", 0.0)],
        columns=["surrogate", "slurry", "skill"],
    )
    figure = plot_skill.draw_skill(skill)
    axes = figure.axes[0]
    assert texts(axes.texts) == ["1: −6.5", "2", "1", "2", "affine map", "perturbed run"]
    assert texts(axes.get_yticklabels()) == ["persistence", "affine"]
    dots = [line.get_xdata()[0] for line in axes.lines if line.get_marker() in ("o", "<")]
    assert dots == [-1.0, -0.5, 0.0, 0.0]
    check_saved(figure, tmp_path / "skill.png")
