"""How long to relax: errors in closed form, the numbers of steps that are enough, and the figure."""

import numpy as np
import pandas as pd
import pytest

import plot_relaxation
from pictures import is_drawn, recorded_calls, texts
from script_runs import run_script
from slurrycast.evaluation.noise import COLUMNS, Noise
from slurrycast.evaluation.relaxation import Structure, enough_steps, mean_errors, relaxation_errors

NOISE = Noise(
    "noise.csv",
    pd.DataFrame(
        [
            ("6", 400, "density_g_cm3", 5, 2.25, 0.01),
            ("6", 400, "rdf_all", 5, 0.06, 0.001),
            ("6", 400, "coordination_all", 5, 6.5, 0.05),
        ],
        columns=COLUMNS,
    ),
)


def curve(g: list[float]) -> pd.DataFrame:
    """Curve with equal bins from 0."""
    return pd.DataFrame({"r_um": 0.5 * (np.arange(len(g)) + 0.5), "g": g})


# two replicas that differ by 0.2 in the first three bins, and by more beyond
REPLICAS = {("6", "all"): [curve([1.0, 1.0, 1.0, 1.0]), curve([1.2, 0.8, 1.2, 3.0])]}
DEM = Structure(2.0, curve([1.0, 1.0, 1.0, 1.0]), 6.5)


def test_errors_in_units_of_the_replicas():
    relaxed = {
        500: Structure(2.03, curve([1.1, 0.9, 1.1]), 6.55),
        100: Structure(1.98, curve([1.9, 1.9, 1.9, 9.0]), 6.35),
    }
    # 100 particles scatter twice as much as 400: 0.02 g/cm3, 0.4 over the three bins that all have, and 0.1 contacts
    rows = relaxation_errors(relaxed, DEM, 100, NOISE, REPLICAS)
    assert list(rows.steps) == [100, 500]
    np.testing.assert_allclose(rows.density_error, [-0.01, 0.015])
    np.testing.assert_allclose(rows.density_in_sd, [1.0, 1.5])
    np.testing.assert_allclose(rows.rdf_in_spread, [0.9 / 0.4, 0.1 / 0.4])
    np.testing.assert_allclose(rows.coordination_in_sd, [1.5, 0.5])
    assert rows.within_band.tolist() == [False, True]  # 2.25 spreads in the RDF
    # four times the particles scatter half as much: 3 sd
    assert not relaxation_errors(relaxed, DEM, 400, NOISE, REPLICAS).within_band[1]


@pytest.mark.parametrize(
    ("density_g_cm3", "g", "coordination", "within"),
    [
        (2.039, 1.0, 6.5, True),
        (2.041, 1.0, 6.5, False),
        (2.0, 1 + 0.39 * 3**0.5, 6.5, True),
        (2.0, 1 + 0.41 * 3**0.5, 6.5, False),
        (2.0, 1.0, 6.31, True),
        (2.0, 1.0, 6.29, False),  # contacts come last: all else is that of the DEM
    ],
)
def test_each_measure_has_to_be_within_its_band(density_g_cm3, g, coordination, within):
    relaxed = {1: Structure(density_g_cm3, curve([g] * 3), coordination)}
    assert relaxation_errors(relaxed, DEM, 100, NOISE, REPLICAS).within_band.tolist() == [within]


@pytest.mark.parametrize(
    ("quantity", "column"), [("density_g_cm3", "density_in_sd"), ("coordination_all", "coordination_in_sd")]
)
def test_a_scatter_of_zero_measures_nothing(quantity, column):
    silent = Noise("noise.csv", NOISE.table.assign(sd=NOISE.table.sd.where(NOISE.table.quantity != quantity, 0.0)))
    rows = relaxation_errors({1: DEM}, DEM, 400, silent, REPLICAS)
    assert np.isnan(rows[column][0])
    assert not rows.within_band[0]


def table(within: dict[str, dict[int, list[bool]]]) -> pd.DataFrame:
    """tables/relaxation.csv, by surrogate and steps whether each slurry is within the band."""
    rows = [
        (surrogate, f"V{place}", steps, 0.01, 0.001, 1.0 + place, 0.5, 3.0 * place, 3.0, inside)
        for surrogate, by_steps in within.items()
        for steps, those in by_steps.items()
        for place, inside in enumerate(those, 1)
    ]
    columns = ["surrogate", "slurry", "steps", "overlap_mean_predicted", "density_error", "density_in_sd"]
    return pd.DataFrame(rows, columns=[*columns, "rdf_in_spread", "coordination_in_sd", "cpu_s", "within_band"])


def test_enough_steps_are_those_after_which_all_slurries_are_within():
    within = {
        "soon": {500: [True, True], 2000: [True, True]},
        "late": {2000: [True, True], 500: [True, False]},
        "beyond": {500: [True, True], 2000: [True, False]},
        "never": {500: [False, True], 2000: [True, False]},
    }
    assert enough_steps(table(within)) == {"soon": [500, 2000], "late": [2000], "beyond": [500], "never": []}


def test_means_are_over_the_slurries():
    means = mean_errors(
        table({"b": {500: [True, True]}, "a": {500: [True, True], 20: [True, True]}}), "density_in_sd", ["b", "a"]
    )
    assert list(means.index) == ["b", "a"]
    assert list(means.columns) == [20, 500]
    np.testing.assert_allclose(means, [[np.nan, 2.5], [2.5, 2.5]])


def test_figure_shows_means_bands_and_main_labels(tmp_path, monkeypatch):
    both = {20: [True, True], 500: [True, True]}
    rows = table({"affine": both, "affine_f02": both, "early_dem_x2": both, "vgg16": both, "direct": both})
    rows.loc[(rows.surrogate == "affine") & (rows.steps == 500), "density_in_sd"] = [0.2, 0.4]
    rows.loc[rows.surrogate == "vgg16", "density_in_sd"] = 0.0  # has no place on a logarithmic axis
    rows.to_csv(tmp_path / "relaxation.csv", index=False)
    calls = recorded_calls(monkeypatch, plot_relaxation, "draw_relaxation")
    options = {"relaxation": tmp_path / "relaxation.csv", "figure": tmp_path / "relaxation.png"}
    assert run_script(plot_relaxation, **options).returncode == 0
    figure = calls[0][1]
    density, _, coordination = figure.axes
    lines = {line.get_label(): line for line in density.lines}
    assert list(lines) == ["affine", "early_dem_x2", "vgg16", "direct"]
    assert lines["direct"].get_linewidth() > lines["affine"].get_linewidth()
    np.testing.assert_allclose(lines["affine"].get_xydata(), [[20, 2.5], [500, 0.3]])
    np.testing.assert_allclose(coordination.lines[0].get_ydata(), [4.5, 4.5])
    titles = ["Density (band: 2)", "RDF, all particles (band: 1.73)", "Coordination, all particles (band: 2)"]
    assert [axes.get_title() for axes in figure.axes] == titles
    bands = [axes.patches[0].get_extents().transformed(axes.transData.inverted()).y1 for axes in figure.axes]
    assert bands == pytest.approx([2.0, 3**0.5, 2.0])
    legend = texts(figure.legends[0].get_texts())
    assert sorted(legend) == ["affine", "direct", "early_dem_x2", "noise of the DEM: within the band", "vgg16"]
    assert is_drawn(tmp_path / "relaxation.png")


def test_an_empty_table_is_refused(tmp_path):
    table({}).to_csv(tmp_path / "relaxation.csv", index=False)
    options = {"relaxation": tmp_path / "relaxation.csv", "figure": tmp_path / "relaxation.png"}
    done = run_script("plot_relaxation", **options)
    assert done.returncode == 1
    assert "no relaxation in it" in done.stderr
