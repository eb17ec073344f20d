"""Figures from small synthetic inputs: they exist, they are not blank, and what they show is computed right."""

import json
import os
import re
import signal
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread
from PIL import Image

import plot_coordinates
import plot_densification
import plot_density
import plot_learning_curves
import plot_rdf
import plot_workflow
import render_slurry
from pictures import check_saved, is_drawn, recorded_calls
from script_runs import run_script
from slurrycast.analysis.errors import coordinate_errors
from slurrycast.report import rendering
from slurrycast.report.figures import (
    FURTHER_PHASE_COLOURS,
    FURTHER_SURROGATE_COLOURS,
    PHASE_COLOURS,
    SURROGATE_COLOURS,
    phase_colours,
    save_figure,
    surrogate_colours,
)
from slurrycast.runtime.files import InputError
from structures import frame, particles, write_store

RULE_GRAPH = """digraph snakemake_dag {
    graph[bgcolor=white, margin=0];
    node[shape=box, style=rounded, fontname=sans, fontsize=10, penwidth=2];
    edge[penwidth=2, color=grey];
\t0[label = "all", color = "0.1 0.6 0.85", style="rounded"];
\t1[label = "write_report", color = "0.2 0.6 0.85", style="rounded"];
\t2[label = "run_slurry", color = "0.3 0.6 0.85", style="rounded"];
\t3[label = "generate_inputs", color = "0.4 0.6 0.85", style="rounded"];
\t4[label = "plot_density", color = "0.5 0.6 0.85", style="rounded"];
\t1 -> 0
\t2 -> 1
\t4 -> 1
\t2 -> 4
\t3 -> 2
\t3 -> 1
}
"""


@pytest.fixture
def structures(tmp_path) -> dict[str, Path]:
    """Target, predicted and relaxed structure of one slurry; the prediction is a scaled and shifted target."""
    rng = np.random.default_rng(1)
    edges_um = np.array([4.0, 4.0, 6.0])
    target_um = (rng.random((60, 3)) - 0.5) * edges_um
    frames = {
        "frames": [frame(10, 1.2 * target_um, 1.2 * edges_um), frame(120, target_um, edges_um)],
        "predicted": [frame(120, 1.1 * target_um + 0.3, 1.1 * edges_um)],
        "other": [frame(120, 1.2 * target_um, edges_um)],
        "relaxed": [frame(120, target_um, edges_um)],
    }
    phase = np.repeat([1, 2, 3], 20)
    slurry = particles(phase, np.array([0.55, 0.4, 0.35])[phase - 1], ("BDPD", "NiO", "8YSZ"))
    return {name: write_store(tmp_path / f"{name}.h5", of_file, slurry) for name, of_file in frames.items()}


def draw(script: str | ModuleType, figure: Path, **options: object) -> str:
    """Run a script that draws a figure, and look at it; what it says on the way."""
    done = run_script(script, **options, figure=figure)
    assert done.returncode == 0, done.stderr
    assert is_drawn(figure)
    return done.stderr


def test_phases_keep_their_colours_whatever_their_order():
    assert phase_colours(["NiO", "8YSZ"]) == [PHASE_COLOURS["NiO"], PHASE_COLOURS["8YSZ"]]
    further = FURTHER_PHASE_COLOURS
    assert phase_colours(["GDC", "NiO", "Ni"]) == [further[0], PHASE_COLOURS["NiO"], further[1]]


def test_a_family_keeps_its_colour_and_its_variants_are_told_apart():
    labels = ["affine_f02", "early_dem_x2", "early_dem_x10", "early_dem_x32", "affine", "net", "net_small", "vgg16_box"]
    colours = surrogate_colours(labels)
    assert list(colours) == labels
    assert len(set(colours.values())) == len(labels)
    for name in ("affine", "vgg16_box"):
        assert colours[name] == SURROGATE_COLOURS[name]
    assert colours["early_dem_x2"] == SURROGATE_COLOURS["early_dem"]
    assert colours["net"] == FURTHER_SURROGATE_COLOURS[0]
    brightness = [int(colours[name][1:3], 16) for name in ("early_dem_x2", "early_dem_x10", "early_dem_x32")]
    assert brightness == sorted(brightness)


def test_a_palette_keeps_what_is_drawn(tmp_path):
    figure = plot_learning_curves.new_figure(2, 2)
    figure.subplots().plot([0, 1], color="#18858f", lw=8)
    for colours, name in ((None, "all.png"), (64, "palette.png")):
        save_figure(figure, tmp_path / name, colours=colours)
    pictures = [imread(tmp_path / name)[..., :3] for name in ("all.png", "palette.png")]
    assert np.abs(pictures[0] - pictures[1]).mean() < 0.002
    assert (tmp_path / "palette.png").stat().st_size < (tmp_path / "all.png").stat().st_size


# ---- workflow


def test_rule_graph_is_read_without_hidden_rules():
    parents = plot_workflow.read_rule_graph(RULE_GRAPH, hidden=["all"])
    assert parents == {
        "write_report": {"run_slurry", "plot_density", "generate_inputs"},
        "run_slurry": {"generate_inputs"},
        "generate_inputs": set(),
        "plot_density": {"run_slurry"},
    }


def test_implied_edges_are_left_out():
    parents = plot_workflow.without_implied_edges(plot_workflow.read_rule_graph(RULE_GRAPH, hidden=["all"]))
    assert parents["write_report"] == {"plot_density"}


def test_layers_follow_the_arrows_and_boxes_do_not_overlap():
    rng = np.random.default_rng(5)
    names = [f"rule_{i:02d}" for i in range(18)]
    parents = {
        name: set(rng.choice(names[:i], size=min(i, int(rng.integers(1, 4))), replace=False).tolist()) if i else set()
        for i, name in enumerate(names)
    }
    places, arrows = plot_workflow.place_nodes(plot_workflow.without_implied_edges(parents))
    for chain in arrows:
        heights = [places[node][1] for node in chain]
        assert np.allclose(np.diff(heights), -plot_workflow.LAYER_HEIGHT)
    boxes = [place for node, place in places.items() if isinstance(node, str)]
    for i, (x, y) in enumerate(boxes):
        for other_x, other_y in boxes[:i]:
            assert abs(x - other_x) >= plot_workflow.BOX_WIDTH or abs(y - other_y) >= plot_workflow.BOX_HEIGHT
    lanes = [place for node, place in places.items() if not isinstance(node, str)]
    assert lanes
    for x, y in lanes:
        assert all(y != box_y or abs(x - box_x) > plot_workflow.BOX_WIDTH / 2 for box_x, box_y in boxes)


def test_every_rule_belongs_to_a_part_of_the_workflow(root):
    """Or it is white in the figure of the workflow, as none of them."""
    text = "".join(path.read_text() for path in (root / "workflow" / "rules").rglob("*.smk"))
    verbs = {name.split("_")[0] for name in re.findall(r"^ *rule (\w+):", text, re.M)}
    parts = [verbs for _, verbs in plot_workflow.PARTS.values()]
    assert {"run", "check"} < verbs and verbs - {"record", "draw"} <= set().union(*parts)
    assert sum(map(len, parts)) == len(set().union(*parts))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Building DAG of jobs...", "no rule"),
        ('0[label = "a"];\n1[label = "b"];\n0 -> 1\n1 -> 0\n', "cycle"),
    ],
)
def test_a_graph_that_cannot_be_drawn_is_refused(text, message):
    with pytest.raises(InputError, match=message):
        plot_workflow.read_rule_graph(text)


def test_workflow_diagram(tmp_path):
    graph = tmp_path / "rules.dot"
    graph.write_text(RULE_GRAPH)
    draw(plot_workflow, tmp_path / "workflow.png", rulegraph=graph)


# ---- curves


def test_learning_curves(tmp_path, history):
    figure = plot_learning_curves.draw_learning_curves(history)
    marked = [axes.lines[-1].get_xydata()[0].tolist() for axes in figure.axes]
    assert marked == [[2.0, 0.9], [2.0, 0.8]]
    check_saved(figure, tmp_path / "curves.png")


def test_learning_curves_without_validation_slurries(tmp_path, history):
    figure = plot_learning_curves.draw_learning_curves(history.assign(val_loss=np.nan, val_mae=np.nan))
    assert [[line.get_label() for line in axes.lines] for axes in figure.axes] == [["training"], ["training"]]
    check_saved(figure, tmp_path / "curves.png")


@pytest.mark.parametrize("fit", ["linear", "linear_box"])
def test_learning_curves_beside_a_fit_to_the_same_particles(tmp_path, history, fit):
    model = {
        f"{prefix}{part}_{measure}": value
        for prefix, value in (("", 0.1), ("affine_", 0.2))
        for part in ("training", "validation")
        for measure in ("mse_um2", "mae_um")
    }
    reached = plot_learning_curves.reached_on_particles(model, fit)
    assert reached["where"].tolist() == ["training", "validation"] * 2
    figure = plot_learning_curves.draw_learning_curves(history, reached)
    for axes in figure.axes:
        lines = [(line.get_ydata()[0], line.get_linestyle()) for line in axes.lines if len(set(line.get_ydata())) == 1]
        assert lines.count((0.2, "--")) == lines.count((0.1, ":")) == 2
    (tmp_path / fit).mkdir()
    (tmp_path / fit / "model.json").write_text(json.dumps(model))
    history.to_csv(tmp_path / "history.csv")
    draw(plot_learning_curves, tmp_path / "a.png", history=tmp_path / "history.csv", fit=tmp_path / fit / "model.json")


def test_the_start_of_a_long_training_does_not_hide_its_end():
    loss = np.full(50, 0.1)
    loss[:3], loss[20] = 5, 0.3
    history = pd.DataFrame({"epoch": np.arange(50) + 1, "loss": loss, "mae": loss, "val_loss": loss, "val_mae": loss})
    for axes in plot_learning_curves.draw_learning_curves(history).axes:
        assert 0.3 < axes.get_ylim()[1] < 0.4


def test_learning_curves_with_held_out_slurries_beside_fits(tmp_path, history):
    history = history.assign(test_slurries_loss=[4, np.nan, 2], test_slurries_mae=[3, np.nan, 1])
    rows = [
        (name, slurry, axis, 0.1 * k, 0.2 * k)
        for name in ("affine", "linear", "vgg16")
        for k, slurry in enumerate(("1", "2", "V1"), start=1)
        for axis in ("x", "all")
    ]
    errors = pd.DataFrame(rows, columns=["surrogate", "slurry", "axis", "mse_um2", "mae_um"])
    reached = plot_learning_curves.reached_on_slurries(errors, ["1", "2"])
    assert reached.surrogate.tolist() == ["affine", "linear"]
    np.testing.assert_allclose(reached[["mse_um2", "mae_um"]], [[0.15, 0.3]] * 2)
    figure = plot_learning_curves.draw_learning_curves(history, reached)
    for axes, shown in zip(figure.axes, ([[1, 4], [3, 2]], [[1, 3], [3, 1]]), strict=True):
        lines = {line.get_label(): line.get_xydata().tolist() for line in axes.lines}
        assert lines["test slurries"] == shown
        assert {"training", "validation", "affine, in the same colours", "linear, in the same colours"} <= lines.keys()
    check_saved(figure, tmp_path / "curves.png")


def test_learning_curves_of_a_model_trained_elsewhere(tmp_path):
    history = tmp_path / "history.csv"
    history.write_text("epoch,loss,mae,val_loss,val_mae\n")
    draw(plot_learning_curves, tmp_path / "curves.png", history=history)


def test_densification(tmp_path):
    time_us = np.linspace(0, 10, 11)
    thermo = {
        name: pd.DataFrame({"time_us": time_us[:end], "density_g_cm3": 1 + 0.1 * time_us[:end]})
        for name, end in (("T1", 11), ("T2", 11), ("1", 11), ("N1", 4))
    }
    equilibrium = pd.DataFrame(
        {
            "role": ["train", "train", "test", "new"],
            "mass_units": [1.0, 1.0, 2.0, 2.0],
            "time_to_equilibrium_us": [8.0, 9.5, 9.0, np.nan],
            "warning": ["", "still denser by the hour", "", ""],
        },
        index=["T1", "T2", "1", "N1"],
    )
    figure = plot_densification.draw_densification(thermo, equilibrium, [1.0, 2.0])
    points = [line.get_xydata()[0] for line in figure.axes[0].lines if line.get_marker() == "o"]
    assert np.allclose(points, [[8.0, 1.8], [9.0, 1.9]])
    check_saved(figure, tmp_path / "densification.png")


def test_density_of_known_and_new_slurries(tmp_path):
    rows = [("-", "2", "DEM", 2.25), ("net", "2", "hybrid", 2.295), ("net", "N1", "hybrid", 2.27)]
    rows += [("affine", "2", "hybrid", 2.205), ("affine", "N1", "hybrid", 2.26)]
    densities = pd.DataFrame(rows, columns=["surrogate", "slurry", "model", "density_g_cm3"])
    figure = plot_density.draw_density(densities, ["2", "N1"], ["affine", "net"])
    upper, lower = figure.axes
    drawn = {line.get_label(): line.get_ydata().tolist() for line in upper.lines}
    assert drawn["net"] == [2.295, 2.27]
    assert drawn["affine"] == [2.205, 2.26]
    colours = surrogate_colours(["affine", "net"])
    percent = {line.get_color(): line.get_ydata()[0] for line in lower.lines}
    assert percent[colours["net"]] == pytest.approx(2.0)
    assert percent[colours["affine"]] == pytest.approx(-2.0)
    check_saved(figure, tmp_path / "density.png")


def test_density_without_any_dem(tmp_path):
    table = tmp_path / "density_volume.csv"
    table.write_text("surrogate,slurry,model,density_g_cm3,volume_um3\nnet,NA,hybrid,2.27,100.0\n")
    options = {"density": table, "surrogates": ["net"], "slurries": ["NA"]}
    draw(plot_density, tmp_path / "density.png", **options)


def rdf_curves(slurries: dict, surrogates: list[str]) -> pd.DataFrame:
    """Curves of two pairs with a peak that is higher for each further surrogate; `slurries` maps ids to has-target."""
    r_um = np.arange(0.05, 3, 0.1)
    peak = np.exp(-((r_um - 0.8) ** 2))
    return pd.concat(
        pd.DataFrame(
            {"surrogate": surrogate, "slurry": slurry, "pair": pair, "r_um": r_um}
            | {"g_dem": 1 + peak if target else np.nan, "g_predicted": 1.0, "g_relaxed": 1 + (1 + 0.1 * place) * peak}
        )
        for slurry, target in slurries.items()
        for place, surrogate in enumerate(surrogates)
        for pair in ("all", "NiO-8YSZ")
    )


def test_rdf_of_slurries_with_and_without_target(tmp_path):
    surrogates = ["affine", "net"]
    differences = {("net", "1", "all"): 0.0123, ("affine", "1", "all"): 0.0789, ("net", "1", "NiO-8YSZ"): 0.0456}
    figure = plot_rdf.draw_rdf(rdf_curves({"1": True, "N1": False}, surrogates), ["1", "N1"], surrogates, differences)
    panel = figure.axes[0]
    colours = surrogate_colours(surrogates)
    shown = {text.get_text(): text.get_color() for text in panel.texts}
    assert shown["12.3"] == colours["net"]
    assert shown["78.9"] == colours["affine"]
    peaks = {line.get_color(): np.max(line.get_ydata()) for line in panel.lines}
    assert peaks[colours["net"]] > peaks[colours["affine"]]
    assert [axes.get_title() for axes in figure.axes][:2] == ["Slurry 1", "Slurry N1"]
    check_saved(figure, tmp_path / "rdf.png")


def test_rdf_without_any_target(tmp_path):
    rdf_curves({"N1": False}, ["net"]).to_csv(tmp_path / "N1.csv", index=False)
    errors = tmp_path / "rdf_errors.csv"
    errors.write_text("surrogate,slurry,pair,r_max_um,bins,mean_abs_difference\n")
    options = {"slurries": ["N1"], "rdf": tmp_path / "N1.csv", "rdf_errors": errors, "surrogates": ["net"]}
    draw(plot_rdf, tmp_path / "rdf.png", **options)


# ---- structures


def test_coordinates_show_the_errors_of_the_table(tmp_path, structures, monkeypatch):
    calls = recorded_calls(monkeypatch, plot_coordinates, "draw_coordinates")
    files = {"predicted": [structures["predicted"], structures["other"]], "frames": structures["frames"]}
    draw(plot_coordinates, tmp_path / "coordinates.png", **files, surrogates=["net", "other"], target_frame=120)
    ((target_um, predicted_um, _, errors), figure) = calls[0]
    # without the shift, the prediction is 1.1 times the target
    assert np.allclose(predicted_um["net"], 1.1 * target_um)
    assert np.allclose(predicted_um["other"], 1.2 * target_um)
    assert errors == {name: coordinate_errors(target_um, position_um) for name, position_um in predicted_um.items()}
    assert errors["net"]["x"].r2 == pytest.approx(1 - 0.1**2)
    titles = [axes.get_title() for axes in figure.axes if axes.get_title()]
    assert titles == [f"{name}, {axis} axis" for name in ("net", "other") for axis in "xyz"]


def test_view_is_orthonormal_and_holds_every_box(structures):
    view = rendering.view_axes()
    assert np.allclose(view @ view.T, np.eye(3))
    assert np.linalg.det(view) == pytest.approx(1)
    shown = [rendering.read_structure(path, name) for name, path in structures.items()]
    half_um = rendering.half_size_um(shown)
    for structure in shown:
        assert np.all(np.abs(structure.position_um) <= structure.edges_um / 2)
        assert np.all(np.abs(structure.position_um @ view[:2].T) + structure.particles.radius_um[:, None] <= half_um)


@pytest.mark.parametrize("rendered", [True, False])
def test_pictures_with_and_without_a_renderer(tmp_path, structures, monkeypatch, rendered):
    if not rendered:
        monkeypatch.setattr(rendering, "rendered_by_child", lambda *_: False)
    shown = {name: structures[name] for name in ("frames", "predicted", "relaxed")}
    said = draw(render_slurry, tmp_path / "slurry.png", **shown, target_frame=120)
    assert rendered or "Matplotlib" in said
    with Image.open(tmp_path / "slurry.png") as picture:
        assert picture.mode == "P"  # a third of the size


@pytest.mark.parametrize("radius_pixels", [0.1, 1, 10, 22, 100])
def test_spheres_have_as_many_corners_as_their_size_shows(radius_pixels):
    corners = rendering.corners_of_circle(radius_pixels)
    assert radius_pixels * (1 - np.cos(np.pi / corners)) <= 0.5
    assert corners == 8 or radius_pixels * (1 - np.cos(np.pi / (corners - 1))) > 0.5


def end_with_a_crash(_structures, _half_um, paths):
    paths[0].write_bytes(b"half a picture")
    os.kill(os.getpid(), signal.SIGSEGV)


def test_a_crash_of_the_renderer_is_survived(structures, monkeypatch, tmp_path):
    monkeypatch.setattr(rendering, "render_with_pyvista", end_with_a_crash)
    structure = rendering.read_structure(structures["relaxed"], "Relaxed")
    half_um = rendering.half_size_um([structure])
    picture = tmp_path / "picture.png"
    assert not rendering.rendered_by_child([structure], half_um, [picture])
    assert picture.is_file()


def test_a_new_slurry_has_no_target_panel(structures):
    shown = [rendering.read_structure(structures[name], name) for name in ("predicted", "relaxed")]
    figure = rendering.draw_structures(shown, None)
    assert [axes.get_title() for axes in figure.axes] == ["predicted", "relaxed"]
    thickness = [text.get_text().strip() for axes in figure.axes for text in axes.texts if "L_z" in text.get_text()]
    assert thickness == ["$L_z$ = 6.60 µm", "$L_z$ = 6.00 µm"]


@pytest.mark.parametrize("sources", [["dem"], ["net", "dem"]])
def test_a_slurry_and_its_tapes_lie_on_one_carrier(tmp_path, structures, monkeypatch, sources):
    monkeypatch.setattr(rendering, "rendered_by_child", lambda *_: False)
    calls = recorded_calls(monkeypatch, rendering, "draw_structures")
    tapes = [structures[name] for name in ("relaxed", "predicted")][: len(sources)]
    options = {"slurry": structures["other"], "slurry_source": "dem", "sources": sources, "tapes": tapes}
    draw("render_tape", tmp_path / "render_tape_1.png", **options)
    ((shown, _), figure) = calls[0]
    titles = ["Slurry\nDEM", *(f"Tape\n{source.replace('dem', 'DEM')}" for source in sources)]
    assert [axes.get_title() for axes in figure.axes] == titles
    lowest_um = -max(structure.edges_um[2] for structure in shown) / 2
    for structure in shown:
        assert np.allclose(structure.lower_um, [*(-structure.edges_um[:2] / 2), lowest_um])
        assert np.allclose(structure.corners_um[-1], structure.lower_um + structure.edges_um)
        inside = structure.position_um - structure.lower_um
        assert np.all((inside >= 0) & (inside <= structure.edges_um))
        half_um = rendering.half_size_um(shown)
        seen = structure.position_um @ rendering.view_axes()[:2].T
        assert np.all(np.abs(seen) + structure.particles.radius_um[:, None] <= half_um)
