"""Figures from small synthetic inputs: they exist, they are not blank, and what they show is computed right."""

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

import plot_coordinates
import plot_costs
import plot_densification
import plot_density
import plot_learning_curves
import plot_rdf
import plot_workflow
import render_slurry
from slurrycast.errors import coordinate_errors
from slurrycast.figures import FURTHER_PHASE_COLOURS, PHASE_COLOURS, phase_colours, save_figure
from slurrycast.files import InputError
from slurrycast.frames import Frame, Particles, write_frames
from slurrycast.speedup import HYBRID_PARTS

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


def is_drawn(path: Path) -> bool:
    """Whether a picture shows something: a good share of its pixels differs from the background."""
    pixels = imread(path)[..., :3]
    return pixels.std() > 0.02 and np.mean(np.any(pixels < 0.9, axis=-1)) > 0.01


@pytest.fixture
def particles() -> Particles:
    phase = np.repeat([1, 2, 3], 20)
    radius_um = np.array([0.55, 0.4, 0.35])[phase - 1]
    mass_pg = 4.0 * radius_um**3
    ones = np.ones(60, dtype=int)
    return Particles(np.arange(1, 61), phase, phase, ones, radius_um, mass_pg, ("BDPD", "NiO", "8YSZ"))


def frame(number: int, position_um: np.ndarray, edges_um: np.ndarray) -> Frame:
    scaled = position_um / edges_um + 0.5
    coordination = np.zeros(len(position_um))
    return Frame(number, number * 10, float(number), position_um, scaled, coordination, -edges_um / 2, edges_um)


@pytest.fixture
def structures(tmp_path, particles) -> dict[str, Path]:
    """Target, predicted and relaxed structure of one slurry; the prediction is a scaled and shifted target."""
    rng = np.random.default_rng(1)
    edges_um = np.array([4.0, 4.0, 6.0])
    target_um = (rng.random((60, 3)) - 0.5) * edges_um
    paths = {name: tmp_path / f"{name}.h5" for name in ("frames", "predicted", "relaxed")}
    write_frames(
        paths["frames"], particles, [frame(10, 1.2 * target_um, 1.2 * edges_um), frame(120, target_um, edges_um)], {}
    )
    write_frames(paths["predicted"], particles, [frame(120, 1.1 * target_um + 0.3, 1.1 * edges_um)], {})
    write_frames(paths["relaxed"], particles, [frame(120, target_um, edges_um)], {})
    return paths


def run_script(script, monkeypatch, **options) -> None:
    arguments = [word for name, value in options.items() for word in (f"--{name.replace('_', '-')}", *map(str, value))]
    monkeypatch.setattr(sys, "argv", [script.__name__, *arguments])
    script.main()


def test_phases_keep_their_colours_whatever_their_order():
    assert phase_colours(["NiO", "8YSZ"]) == [PHASE_COLOURS["NiO"], PHASE_COLOURS["8YSZ"]]
    assert phase_colours(["GDC", "NiO", "Ni"]) == [
        FURTHER_PHASE_COLOURS[0],
        PHASE_COLOURS["NiO"],
        FURTHER_PHASE_COLOURS[1],
    ]


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


def test_workflow_diagram(tmp_path, monkeypatch):
    graph = tmp_path / "rules.dot"
    graph.write_text(RULE_GRAPH)
    run_script(plot_workflow, monkeypatch, rulegraph=[graph], figure=[tmp_path / "workflow.png"])
    assert is_drawn(tmp_path / "workflow.png")


# ---- curves


def test_learning_curves(tmp_path, history):
    figure = plot_learning_curves.draw_learning_curves(history)
    marked = [axes.lines[-1].get_xydata()[0].tolist() for axes in figure.axes]
    assert marked == [[2.0, 0.9], [2.0, 0.8]]
    save_figure(figure, tmp_path / "curves.png")
    assert is_drawn(tmp_path / "curves.png")


def test_learning_curves_of_a_model_trained_elsewhere(tmp_path, monkeypatch):
    history = tmp_path / "history.csv"
    history.write_text("epoch,loss,mae,val_loss,val_mae\n")
    run_script(plot_learning_curves, monkeypatch, history=[history], figure=[tmp_path / "curves.png"])
    assert is_drawn(tmp_path / "curves.png")


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
    save_figure(figure, tmp_path / "densification.png")
    assert is_drawn(tmp_path / "densification.png")


def test_density_of_known_and_new_slurries(tmp_path):
    densities = pd.DataFrame(
        [("-", "2", "DEM", 2.25), ("net", "2", "hybrid", 2.30), ("net", "N1", "hybrid", 2.27)],
        columns=["surrogate", "slurry", "model", "density_g_cm3"],
    )
    figure = plot_density.draw_density(densities, ["2", "N1"], "net")
    labels = {text.get_text() for text in figure.axes[0].texts}
    assert labels == {"2.250", "2.300", "2.270"}
    save_figure(figure, tmp_path / "density.png")
    assert is_drawn(tmp_path / "density.png")


def test_density_without_any_dem(tmp_path, monkeypatch):
    table = tmp_path / "density_volume.csv"
    table.write_text("surrogate,slurry,model,density_g_cm3,volume_um3\nnet,NA,hybrid,2.27,100.0\n")
    options = {"density": [table], "surrogate": ["net"], "slurries": ["NA"]}
    run_script(plot_density, monkeypatch, **options, figure=[tmp_path / "density.png"])
    assert is_drawn(tmp_path / "density.png")


def test_rdf_of_one_slurry_with_and_one_without_target(tmp_path):
    r_um = np.arange(0.05, 3, 0.1)
    curve = 1 + np.exp(-((r_um - 0.8) ** 2))
    tables = {
        slurry: pd.concat(
            pd.DataFrame({"pair": pair, "r_um": r_um, "g_dem": dem, "g_predicted": curve, "g_relaxed": curve})
            for pair in ("all", "NiO-8YSZ")
        )
        for slurry, dem in (("1", curve), ("N1", np.nan))
    }
    figure = plot_rdf.draw_rdf(tables, {("1", "all"): 0.0123, ("1", "NiO-8YSZ"): 0.0456})
    shown = " ".join(text.get_text() for axes in figure.axes for text in axes.texts)
    assert "0.012" in shown
    assert "0.046" in shown
    assert [axes.get_title() for axes in figure.axes][:2] == ["Slurry 1", "Slurry N1"]
    save_figure(figure, tmp_path / "rdf.png")
    assert is_drawn(tmp_path / "rdf.png")


def test_rdf_without_any_target(tmp_path, monkeypatch):
    r_um = np.arange(0.05, 3, 0.1)
    curves = {"surrogate": "net", "slurry": "N1", "pair": "all", "r_um": r_um, "g_dem": np.nan, "g_predicted": r_um}
    pd.DataFrame(curves | {"g_relaxed": r_um}).to_csv(tmp_path / "N1.csv", index=False)
    errors = tmp_path / "rdf_errors.csv"
    errors.write_text("surrogate,slurry,pair,r_max_um,bins,mean_abs_difference\n")
    options = {"slurries": ["N1"], "rdf": [tmp_path / "N1.csv"], "rdf_errors": [errors], "surrogate": ["net"]}
    run_script(plot_rdf, monkeypatch, **options, figure=[tmp_path / "rdf.png"])
    assert is_drawn(tmp_path / "rdf.png")


def test_costs(tmp_path):
    comparison = pd.DataFrame(
        {
            "slurry": ["1", "N1"],
            "run_slurry_to_input": [10.0, 12.0],
            "predict_slurry": [2.0, 2.0],
            "wrap_slurry": [1.0, 1.0],
            "relax_slurry": [7.0, 8.0],
            "hybrid": [20.0, 23.0],
            "dem": [100.0, np.nan],
            "dem_to_equilibrium": [60.0, np.nan],
            "ratio": [5.0, np.nan],
            "ratio_to_equilibrium": [3.0, np.nan],
        }
    )
    figure = plot_costs.draw_costs(comparison)
    assert [text.get_text() for text in figure.axes[0].texts] == ["5.0 ×  (3.0 × to equilibrium)"]
    save_figure(figure, tmp_path / "costs.png")
    assert is_drawn(tmp_path / "costs.png")
    new = plot_costs.draw_costs(comparison[1:].reset_index(drop=True))
    labels = [[text.get_text() for text in shown.legends[0].get_texts()] for shown in (figure, new)]
    assert labels == [["full DEM", "of it after equilibrium", *HYBRID_PARTS.values()], [*HYBRID_PARTS.values()]]
    save_figure(new, tmp_path / "new.png")
    assert is_drawn(tmp_path / "new.png")


# ---- structures


def test_coordinates_show_the_errors_of_the_table(tmp_path, structures, monkeypatch):
    drawn = {}
    original = plot_coordinates.draw_coordinates

    def record(target_um, predicted_um, particles, errors):
        drawn.update(target=target_um, predicted=predicted_um, errors=errors)
        return original(target_um, predicted_um, particles, errors)

    monkeypatch.setattr(plot_coordinates, "draw_coordinates", record)
    path = tmp_path / "coordinates.png"
    files = {"predicted": [structures["predicted"]], "frames": [structures["frames"]]}
    run_script(plot_coordinates, monkeypatch, **files, target_frame=[120], figure=[path])
    # without the shift, the prediction is 1.1 times the target
    assert np.allclose(drawn["predicted"], 1.1 * drawn["target"])
    assert drawn["errors"] == coordinate_errors(drawn["target"], drawn["predicted"])
    assert drawn["errors"]["x"].r2 == pytest.approx(1 - 0.1**2)
    assert is_drawn(path)


def test_view_is_orthonormal_and_holds_every_box(structures):
    view = render_slurry.view_axes()
    assert np.allclose(view @ view.T, np.eye(3))
    assert np.linalg.det(view) == pytest.approx(1)
    shown = [render_slurry.read_structure(path, name) for name, path in structures.items()]
    half_um = render_slurry.half_size_um(shown)
    for structure in shown:
        assert np.all(np.abs(structure.position_um) <= structure.edges_um / 2)
        assert np.all(np.abs(structure.position_um @ view[:2].T) + structure.particles.radius_um[:, None] <= half_um)


@pytest.mark.parametrize("rendered", [True, False])
def test_pictures_with_and_without_a_renderer(tmp_path, structures, monkeypatch, capsys, rendered):
    if not rendered:
        monkeypatch.setattr(render_slurry, "rendered_by_child", lambda *_: False)
    path = tmp_path / "slurry.png"
    run_script(
        render_slurry,
        monkeypatch,
        **{name: [structures[name]] for name in structures},
        target_frame=[120],
        figure=[path],
    )
    assert is_drawn(path)
    if not rendered:
        assert "Matplotlib" in capsys.readouterr().err


def end_with_a_crash(_structures, _half_um, paths):
    paths[0].write_bytes(b"half a picture")
    os.kill(os.getpid(), signal.SIGSEGV)


def test_a_crash_of_the_renderer_is_survived(structures, monkeypatch, tmp_path):
    monkeypatch.setattr(render_slurry, "render_with_pyvista", end_with_a_crash)
    structure = render_slurry.read_structure(structures["relaxed"], "Relaxed")
    half_um = render_slurry.half_size_um([structure])
    picture = tmp_path / "picture.png"
    assert not render_slurry.rendered_by_child([structure], half_um, [picture])
    assert picture.is_file()


def test_a_new_slurry_has_no_target_panel(structures):
    shown = [render_slurry.read_structure(structures[name], name) for name in ("predicted", "relaxed")]
    figure = render_slurry.draw_slurry(shown, None)
    assert [axes.get_title() for axes in figure.axes] == ["predicted", "relaxed"]
    thickness = [text.get_text().strip() for axes in figure.axes for text in axes.texts if "L_z" in text.get_text()]
    assert thickness == ["$L_z$ = 6.60 µm", "$L_z$ = 6.00 µm"]
