"""Figures of cost, front and skill from small synthetic tables: they are not blank and show the right numbers."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

import plot_costs
import plot_front
import plot_skill
from slurrycast.figures import save_figure
from slurrycast.speedup import HYBRID_PARTS


def is_drawn(path: Path) -> bool:
    """Whether a picture shows something: a good share of its pixels differs from the background."""
    pixels = imread(path)[..., :3]
    return pixels.std() > 0.02 and np.mean(np.any(pixels < 0.9, axis=-1)) > 0.01


def texts(axes) -> list[str]:
    return [text.get_text() for text in axes.texts]


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
    assert [texts(axes) for axes in figure.axes] == [["5.0 × (3.0 ×)"]] * 3
    assert len({axes.get_xlim() for axes in figure.axes}) == 1
    ends = [max(bar.get_x() + bar.get_width() for bar in axes.patches) for axes in figure.axes]
    assert ends == pytest.approx([20.0] * 3)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["DEM to equilibrium", "full DEM", *HYBRID_PARTS.values()]
    save_figure(figure, tmp_path / "costs.png")
    assert is_drawn(tmp_path / "costs.png")


def test_costs_of_new_slurries_only(tmp_path):
    figure = plot_costs.draw_costs(comparison("net")[1:])
    assert texts(figure.axes[0]) == []
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [*HYBRID_PARTS.values()]
    save_figure(figure, tmp_path / "new.png")
    assert is_drawn(tmp_path / "new.png")


def test_costs_of_an_unknown_surrogate(tmp_path, monkeypatch):
    table = tmp_path / "speedup.csv"
    comparison("net").to_csv(table, index=False)
    options = ["--speedup", str(table), "--surrogates", "net", "vgg", "--figure", str(tmp_path / "costs.png")]
    monkeypatch.setattr(sys, "argv", ["plot_costs", *options])
    with pytest.raises(plot_costs.InputError, match="--surrogates vgg: not in"):
        plot_costs.main()
    assert not (tmp_path / "costs.png").exists()


def test_front_marks_those_that_are_on_it(tmp_path, monkeypatch):
    labels = ["affine", "affine_f02", "early_dem_x2", "early_dem_x10_f02", "vgg16"]
    points = {
        "surrogate": labels,
        "input_last_frame": [10, 2, 10, 2, 10],
        "cost_share_of_full_dem": [0.1, 0.05, 0.4, 0.3, 1.2],
        "density_error": [0.004, 0.005, 0.002, 0.0045, 0.001],
        "rdf_error": [0.02, 0.02, 0.02, 0.01, 0.03],
    }
    test, validation = (pd.DataFrame(points | {"slurry": slurry}) for slurry in ("2", "V1"))
    validation.density_error *= 100
    pd.concat([test, validation]).to_csv(tmp_path / "front.csv", index=False)
    roles = pd.DataFrame({"slurry": ["2", "V1"], "role": ["test", "validation"], "warning": ""})
    roles.to_csv(tmp_path / "equilibrium.csv", index=False)
    errors = {"surrogate": "affine", "slurry": "2", "stage": "relaxed", "quantity": ["density_g_cm3", "rdf_all"]}
    errors |= {"value": [2.0, 0.02], "dem_value": [2.0, 0.0], "replica_sd": [0.006, 0.015]}
    pd.DataFrame(errors).to_csv(tmp_path / "structure_errors.csv", index=False)

    comparison("affine").assign(slurry=["2", "N1"], clock="cpu_s").to_csv(tmp_path / "speedup.csv", index=False)

    drawn = {}
    original = plot_front.draw_front
    monkeypatch.setattr(plot_front, "draw_front", lambda *given: drawn.setdefault("figure", original(*given)))
    words = ["plot_front", "--figure", str(tmp_path / "front.png")]
    for name in ("front", "equilibrium", "structure_errors", "speedup"):
        words += [f"--{name.replace('_', '-')}", str(tmp_path / f"{name}.csv")]
    monkeypatch.setattr(sys, "argv", words)
    plot_front.main()
    density, rdf = drawn["figure"].axes
    assert sorted(texts(density)) == ["f02", "f10", "f10", "x10 f02", "x2 f10"]
    bold = [[text.get_text() for text in axes.texts if text.get_weight() == "bold"] for axes in (density, rdf)]
    assert [sorted(names) for names in bold] == [["f02", "f10", "x2 f10"], ["f02", "x10 f02"]]
    front = next(line for line in density.lines if line.get_label() == "front")
    np.testing.assert_allclose(front.get_xydata(), [[5, 0.5], [10, 0.4], [40, 0.2]])  # both in %
    equilibrium = next(line for line in density.lines if line.get_label() == "DEM to its own equilibrium")
    assert set(equilibrium.get_xdata()) == {60}
    assert [axes.get_title() for axes in (density, rdf)] == [
        "Density (band: 2 sd of replicas)",
        "RDF, all pairs (band: mean difference between two replicas)",
    ]
    band = next(patch for patch in density.patches if patch.get_label() == "noise of the DEM: order not resolved")
    assert band.get_extents().transformed(density.transData.inverted()).y1 == pytest.approx(0.6)
    assert is_drawn(tmp_path / "front.png")


def test_front_without_replicas(tmp_path):
    columns = {"surrogate": ["affine"], "input_last_frame": [10], "cost_share_of_full_dem": [0.1]}
    points = pd.DataFrame(columns | {"density_error": [0.004], "rdf_error": [0.02]})
    figure = plot_front.draw_front(points, {"density_error": np.nan, "rdf_error": np.nan}, np.nan)
    assert [len(axes.patches) for axes in figure.axes] == [0, 0]
    save_figure(figure, tmp_path / "front.png")
    assert is_drawn(tmp_path / "front.png")


def test_skill_below_the_axis_is_written(tmp_path):
    skill = pd.DataFrame(
        [("persistence", "1", -6.54), ("persistence", "2", -0.5), ("affine", "1", 0.0), ("affine", "2", 0.0)],
        columns=["surrogate", "slurry", "skill"],
    )
    figure = plot_skill.draw_skill(skill)
    axes = figure.axes[0]
    assert texts(axes) == ["1: −6.5", "2", "1", "2", "affine map", "twin floor"]
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["persistence", "affine"]
    dots = [line.get_xdata()[0] for line in axes.lines if line.get_marker() in ("o", "<")]
    assert dots == [-1.0, -0.5, 0.0, 0.0]
    save_figure(figure, tmp_path / "skill.png")
    assert is_drawn(tmp_path / "skill.png")
