"""The report from small tables: numbers, conditions and a file that loads nothing from elsewhere."""

import json
import zipfile
from dataclasses import replace

import h5py
import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imsave

from configurations import load, merged
from html_pages import Page
from slurrycast.evaluation.speedup import HYBRID_PARTS, dem_seconds, time_unit
from slurrycast.evaluation.verdicts import by_verdict
from slurrycast.report import reference_article
from slurrycast.report.formats import SlurryValue, listed, named, number, span
from slurrycast.report.network_table import read_network
from slurrycast.report.results import Results
from slurrycast.report.sections import report_html
from slurrycast.report.statistics import article_structures, extrapolations, gains_over_affine
from slurrycast.runtime.files import InputError

PHASES = {"NiO": (0.6, 6.67, 0.6), "BDPD": (0.4, 0.8, 1.1)}  # mass fraction, g/cm3, um
CONFIG = merged(
    load("config"),
    {
        "run": {"name": "unit"},
        "formulation": {"unit_mass_pg": 100.0},
        "dem": {"steps": 1200},
        "surrogate": {"names": ["affine", "net"], "net": {"epochs": 3, "batch_size": 10, "learning_rate": 1e-4}},
        "relaxation": {"steps": 50},
    },
)
CONFIG["formulation"]["phases"] = {
    name: {"mass_fraction": mass_fraction, "density_g_cm3": density_g_cm3}
    | {"size_classes": [{"diameter_um": diameter_um, "number_fraction": 1.0}]}
    for name, (mass_fraction, density_g_cm3, diameter_um) in PHASES.items()
}


@pytest.fixture
def model(tmp_path):
    """A .keras file with one convolution and one dense layer."""
    same = {"padding": "same"}
    relu = same | {"activation": "relu"}
    layers = [
        ("InputLayer", {"batch_shape": [None, 3, 2]}),
        ("Conv1D", {"filters": 5, "kernel_size": [3], "strides": [1], "use_bias": True} | relu),
        ("MaxPooling1D", {"pool_size": [2], "strides": [2]} | same),
        ("Flatten", {}),
        ("Dense", {"units": 3, "activation": "linear", "use_bias": True}),
        ("Unknown", {}),
    ]
    path, weights = tmp_path / "model.keras", tmp_path / "weights.h5"
    shapes = {"layers/conv1d/vars/0": (3, 2, 5), "layers/conv1d/vars/1": 5, "layers/dense/vars/0": (10, 3)}
    shapes |= {"layers/dense/vars/1": 3, "optimizer/vars/0": 999}
    with h5py.File(weights, "w") as file:
        for name, shape in shapes.items():
            file[name] = np.zeros(shape)
    with zipfile.ZipFile(path, "w") as archive:
        config = {"config": {"layers": [{"class_name": kind, "config": settings} for kind, settings in layers]}}
        archive.writestr("config.json", json.dumps(config))
        archive.write(weights, "model.weights.h5")
    return path


def speedup_table(surrogates: tuple[str, ...]) -> pd.DataFrame:
    """Hybrid runs of 20 s, three fifths of it relaxation; slurry 6 is not in equilibrium, N1 has no full DEM."""
    parts = dict.fromkeys(HYBRID_PARTS, 0.5) | {"relax_slurry": 12.0}
    parts["run_slurry_to_input"] = 8.0 - 0.5 * (len(HYBRID_PARTS) - 2)
    dem = {"2": (100.0, 20.0), "6": (100.0, np.nan), "N1": (np.nan, np.nan)}
    rows = [
        {"surrogate": name, "slurry": slurry, "clock": clock, "particles": 100}
        | parts
        | {"hybrid": 20.0, "dem": full, "dem_to_equilibrium": early, "ratio": full / 20}
        | {"ratio_to_equilibrium": early / 20, "hybrid_to_tape": np.nan}
        for clock in ("wall_s", "cpu_s")
        for name in surrogates
        for slurry, (full, early) in dem.items()
    ]
    return pd.DataFrame(rows)


@pytest.fixture
def results(tmp_path, model, history) -> Results:
    """A run of two surrogates with a training slurry, two of role test, of which "6" is the worst, and a new one."""
    roles = {"T1": "train", "2": "test", "6": "test", "N1": "new"}
    surrogates = ("affine", "net")
    equilibrium = pd.DataFrame(
        {
            "slurry": list(roles),
            "role": list(roles.values()),
            "mass_units": [1.0, 1.0, 5.0, 1.0],
            "thickness_ratio": 2.0,
            "particles": [100, 100, 500, 100],
            "density_g_cm3": [2.24, 2.24, 2.1, 1.0],
            "mean_contacts": 6.0,
            "density_drift": [0.0001, 0.0002, 0.01, np.nan],
            "time_to_equilibrium_us": [1.2, 1.2, 2.3, np.nan],
            "temperature_densifying_k": [62000.0, 62000.0, 108000.4, 75000.0],
            "temperature_k": [860.0, 860.0, 190.0, 62000.0],
            "temperature_rotational_k": [10.0, 10.0, 80.0, 300.0],
            "kinetic_share": [2.5e-7, 2.5e-7, 1.2e-7, 1e-5],
            "run_time_us": [2.4, 2.4, 2.4, 0.2],
            "warning": ["", "", "density drifts by <1 %> & more", ""],
        }
    )
    ends = [(700.0, 40.0, 101.3, 2e-7), (900.0, 20.0, 101.9, 3e-7), (800.0, 30.0, 103.9, 1e-3)]
    end_state = ("temperature_k", "temperature_rotational_k", "pressure_kpa")
    relaxation_ends = pd.DataFrame(
        [
            (name, slurry, 50, *end, np.nan)
            for name in surrogates
            for slurry, end in zip(("2", "6", "N1"), ends, strict=True)
        ],
        columns=["surrogate", "slurry", "steps", *end_state, "kinetic_share", "warning"],
    ).astype({"warning": object})
    hybrid = {
        "net": {"2": (2.2512, 44.4), "6": (2.31, 216.4), "N1": (2.2345, 44.7)},
        "affine": {"2": (2.2624, 44.2), "6": (2.163, 231.1), "N1": (2.2222, 45.0)},
    }
    of_dem = {"T1": (2.24, 44.6), "2": (2.24, 44.6), "6": (2.1, 238.1)}
    density = pd.DataFrame(
        [
            (name, slurry, "DEM" if name == "-" else "hybrid", *values)
            for name, by_slurry in ({"-": of_dem} | hybrid).items()
            for slurry, values in by_slurry.items()
        ],
        columns=["surrogate", "slurry", "model", "density_g_cm3", "volume_um3"],
    )
    values = {"2": (100, 1.5), "6": (500, 1.4), "N1": (100, 1.5)}
    training_range = pd.DataFrame(
        [
            (slurry, roles[slurry], "this run", *row)
            for slurry, (particles, density_g_cm3) in values.items()
            for row in (
                ("particles", particles, 100.0, 100.0, "yes" if slurry == "6" else "no"),
                ("density_g_cm3", density_g_cm3, 1.45, 1.55, "yes" if slurry == "6" else "no"),
                ("fraction_NiO", 0.61, 0.6, 0.6, "no"),
            )
        ],
        columns=["slurry", "role", "model", "quantity", "value", "training_min", "training_max", "outside"],
    )
    measures = ("mse_um2", "mae_um", "r2")
    coordinate_errors = pd.DataFrame(
        [
            (name, slurry, axis, factor * mse, 0.25, r2, 0.5 * factor * mse, 0.2, r2)
            for name, factor in (("affine", 2.0), ("net", 1.0))
            for slurry, mse, r2 in (("2", 0.1234, 0.9876), ("6", 0.4321, 0.9543))
            for axis in ("x", "y", "z", "all")
        ],
        columns=["surrogate", "slurry", "axis", *measures, *(f"{name}_true_box" for name in measures)],
    )
    rdf_errors = pd.DataFrame(
        [
            (name, slurry, pair, 2.1, 36, difference)
            for name, difference in (("affine", 0.0317), ("net", 0.0217))
            for slurry in ("2", "6")
            for pair in ("all", "NiO-8YSZ")
        ],
        columns=["surrogate", "slurry", "pair", "r_max_um", "bins", "mean_abs_difference"],
    )
    costs = [("train_surrogate", "net", "-", 30.0)]
    for slurry, role in roles.items():
        costs += [
            ("run_slurry", "-", slurry, 100.0 if role != "new" else 10.0),
            ("run_slurry_to_input", "-", slurry, 5.0),
        ]
        if role != "train":
            hybrid = (("predict_slurry", 2.0), ("wrap_slurry", 0.5), ("relax_slurry", 12.0))
            costs += [(stage, name, slurry, wall_s) for name in surrogates for stage, wall_s in hybrid]
            costs += [("generate_inputs", "-", slurry, 0.25), ("extract_frames", "-", slurry, 0.25)]
    costs = pd.DataFrame(costs, columns=["stage", "surrogate", "slurry", "wall_s"])
    costs = costs.assign(cpu_s=costs.wall_s, max_rss_mb=100.0)
    segments = [{"step_start": 0, "step_end": 600, "wall_s": 20.0, "cpu_s": 20.0}]
    segments += [{"step_start": 600, "step_end": 1200, "wall_s": 80.0, "cpu_s": 80.0}]
    start = {"wall_s": 0.0, "cpu_s": 0.0}
    run = {"start": start, "segments": segments, "steps": 1200, "lammps_version": "22 Jul 2025"}
    figures = {}
    for stem in ("workflow", "learning_curves_net", "coordinates_2", "slurry_net_N1", "density", "rdf", "costs"):
        figures[stem] = tmp_path / f"{stem}.png"
        imsave(figures[stem], np.random.default_rng(0).random((20, 30, 3)))
    return Results(
        config=CONFIG,
        config_text="run: {name: unit}",
        versions={"python": "3.11.7", "packages": {"keras": "3.15.1"}},
        roles=roles,
        formulations=dict.fromkeys(roles, ""),
        expected_g_cm3=dict.fromkeys(roles, CONFIG["formulation"]["expected_density_g_cm3"]),
        inputs={
            row.slurry: {
                "mass_fractions_reached": {"NiO": 0.601, "BDPD": 0.399},
                "physics": {"slurry": {"mass_units": row.mass_units}, "formulation": CONFIG["formulation"]},
                "types": [{"particles": row.particles - 40}, {"particles": 40}],
            }
            for row in equilibrium.itertuples()
        },
        runs=dict.fromkeys(roles, run),
        density=density,
        coordinate_errors=coordinate_errors,
        rdf_errors=rdf_errors,
        equilibrium=equilibrium,
        relaxation_ends=relaxation_ends,
        microstructure=None,
        drying_ends=None,
        drying_calibration=None,
        training_range=training_range,
        costs=costs,
        speedup=speedup_table(surrogates),
        surrogates=surrogates,
        left_out=[],
        descriptions={name: (f"all that {name} may see", "last frame") for name in surrogates},
        histories={"net": history},
        networks={"net": read_network(model)},
        weights_of={"net": "lowest"},
        figures=figures,
    )


def restricted(results: Results, slurries: list[str], **changes: object) -> Results:
    """The same run with only some of its slurries; `-` stands for all of them."""
    tables = ("equilibrium", "relaxation_ends", "density", "coordinate_errors", "rdf_errors", "costs", "speedup")
    tables += ("training_range",)
    kept = {name: getattr(results, name)[getattr(results, name).slurry.isin([*slurries, "-"])] for name in tables}
    for name in ("roles", "formulations", "expected_g_cm3", "inputs", "runs"):
        kept[name] = {slurry: of_slurry for slurry, of_slurry in getattr(results, name).items() if slurry in slurries}
    return replace(results, **kept | changes)


def adopting(config: dict, path: str) -> dict:
    """The configuration with a model that was trained elsewhere."""
    return config | {"surrogate": config["surrogate"] | {"models": {"net": path}}}


def page_of(results: Results) -> Page:
    return Page(report_html(results))


def notices_of(page: Page) -> list[str]:
    """What the box below the summary says, before the second section."""
    second = [place for place, (tag, _) in enumerate(page.blocks) if tag == "h2"][1]
    return [" ".join(text.split()) for tag, text in page.blocks[:second] if tag == "li"]


def test_network_is_read_from_the_model_file(model):
    network = read_network(model)
    shapes = [layer.output_shape for layer in network.layers]
    assert shapes == [(3, 2), (3, 5), (2, 5), (10,), (3,), None]
    assert [layer.parameters for layer in network.layers] == [0, 35, 0, 0, 33, None]
    assert network.parameters == 68


def test_layers_of_a_network_that_standardises_by_itself(tmp_path):
    from slurrycast.surrogates import samples, vgg16

    standardisation = samples.Standardisation(np.zeros(6), np.ones(6), 3.0)
    vgg16.build(4, 6, standardisation).save(tmp_path / "model.keras")
    network = read_network(tmp_path / "model.keras")
    assert [layer.output_shape for layer in network.layers[1:3]] == [(4, 6), (4, 64)]
    assert (network.layers[-1].output_shape, sum(layer.parameters for layer in network.layers)) == ((3,), 23_803_139)


def test_a_file_that_is_no_model_is_refused(tmp_path):
    path = tmp_path / "model.keras"
    path.write_text("not a zip")
    with pytest.raises(InputError, match=r"model\.keras"):
        read_network(path)


def test_dem_seconds_count_cut_segments_by_their_steps():
    segments = [(0, 100, 1.0), (100, 200, 1.0), (200, 400, 6.0)]
    segments = [{"step_start": first, "step_end": last, "wall_s": wall_s} for first, last, wall_s in segments]
    for steps, seconds in ((0, 0.5), (50, 1.0), (200, 2.5), (250, 4.0), (400, 8.5), (1000, 8.5)):
        assert dem_seconds({"start": {"wall_s": 0.5}, "segments": segments}, steps) == pytest.approx(seconds)


def test_report_holds_the_numbers_and_loads_nothing(results):
    page = page_of(results)
    coordinates, structure = reference_article.COORDINATE_ERRORS["6"], reference_article.HYBRID_STRUCTURE["6"]
    article = [str(coordinates.mse_um2), str(coordinates.r2), f"{structure.density_g_cm3:.4f}", "16,443", "1,230 min"]
    ours = ["2.2512", "2.2345", "0.123", "0.9876", "0.0217", "23,803,139", "2.1000", "0.6010"]
    for expected in (*ours, *article):
        assert expected in page.text, expected
    assert page.loads_nothing
    assert page.images == len(results.figures)


def test_numbers_stand_in_their_rows(results):
    rows = page_of(results).rows
    for row in (
        ["MSE of coordinates (µm²)", "0.555", "0.278", "0.123"],
        ["– largest (its slurry)", "3.00% (6)", "10.00% (6)", "24% (6)"],
        ["Input frames, at steps", "70, 80, 90, 100", "350,000, 400,000, 450,000, 500,000"],
        ["Relaxation after the prediction (steps)", "50", "not stated"],
        ["Learning rate, net", "0.0001", "0.0001"],
        ["NiO", "6.67", "0.6 (1)", "0.6000", "0.6010", "0.10"],
        ["6", "test", "5", "2", "500", "2.4", "2.1000", "6.00", "1.00%", "–", "108,000", "190", "80", "1.2e-07"],
        ["net", "1.0e-03", "700 to 900", "20 to 40", "101.3 to 103.9"],
        ["6", "2.1000", "2.1630", "2.3100", "+3.00%", "+10.00%", "2.2437", "2.7822", "+24.0%"],
        ["6", "2.1", "36", "0.0317", "0.0217", "0.0317", "0.0217"],
        ["N1", "net", "1", "100", "1.0000", "2.2345", "-0.2%", "44.7"],
        ["2", *["5.00"] * 2, *["1.00"] * 2, *["5.00"] * 2],
        ["train surrogate", "1", "30 s", "30 s", "30 s", "100"],
        ["LAMMPS, as its logs say", "22 Jul 2025"],
    ):
        assert row in rows, row


def test_a_surrogate_without_coordinates_has_dashes(results):
    """Like one that knows no places of single particles; then none that does."""
    errors = results.coordinate_errors
    page = page_of(replace(results, coordinate_errors=errors[errors.surrogate == "net"]))
    assert ["MSE of coordinates (µm²)", "–", "0.278", "0.123"] in page.rows
    assert "MSE over all axes is 0.123 µm² (net, largest along x)." in page.text
    page = page_of(replace(results, coordinate_errors=errors[:0]))
    assert ["MSE of coordinates (µm²)", "–", "–", "0.123"] in page.rows
    assert "MSE over all axes" not in page.text


def test_report_escapes_what_it_is_given(results):
    html = report_html(results)
    assert "<1 %>" not in html
    assert "density drifts by <1 %> & more" in Page(html).text


def test_sentences_name_the_right_slurries(results):
    text = page_of(results).text
    for expected in (
        "with net, the largest 0.21 g/cm³ (slurry 6, 10.0% denser than its DEM)",
        "2 and 6 with net",  # lowest and highest MSE
        "at epoch 2, whose weights are used",
        "5 (affine) and 5 (net) times as long as the hybrid run",
        "relaxation with net (60%)",
    ):
        assert expected in text, expected
    assert "Not in equilibrium" not in text  # the figure of the densification is not in this run


def test_notices_come_from_the_data(results):
    drift, density, outside = notices_of(page_of(results))
    assert drift == "Slurry 6: density drifts by <1 %> & more."
    assert "2.100 g/cm³" in density
    assert outside.startswith(
        "Slurry 6: 500 particles, training range 100; density at the last input frame 1.4 g/cm³, training range 1.45"
    )


def test_structures_that_are_not_at_rest_are_named_or_counted(results):
    rows = results.relaxation_ends
    for restless, expected in (
        (3, [f"affine, relaxed slurry {slurry}: too <fast>." for slurry in ("2", "6", "N1")]),
        (5, ["5 relaxed structures have a warning. affine, relaxed slurry 2, for one: too <fast>."]),
    ):
        warned = rows.assign(warning=["too <fast>"] * restless + [np.nan] * (len(rows) - restless))
        notices = notices_of(page_of(replace(results, relaxation_ends=warned)))
        assert [notice for notice in notices if "relaxed" in notice] == expected


def test_tapes_that_are_not_at_rest_are_named(results):
    ends = pd.DataFrame({"source": ["dem", "net"], "slurry": ["2", "2"], "warning": ["moves", np.nan]})
    notices = notices_of(page_of(replace(results, drying_ends=ends)))
    assert [notice for notice in notices if "Tape" in notice] == ["Tape of slurry 2, full DEM: moves."]


def test_page_begins_with_a_picture_the_verdict_and_the_summary(results):
    html = report_html(results)
    places = [
        html.index(text) for text in ("<img", "After relaxation, the surrogates end", "Key results", "To keep in mind")
    ]
    assert places == sorted(places)
    assert Page(html).all("h2")[-2] == "Workflow"


def test_slurries_outside_in_the_same_quantities_share_a_notice(results):
    reached = {"2": (200.0, 1.4), "6": (500.0, 1.4), "7": (400.0, 1.2), "8": (50.0, 1.4)}
    ranges = {"particles": (100.0, 150.0), "density_g_cm3": (1.3, 1.5)}
    rows = [
        (slurry, "this run", quantity, value, low, high, "no" if low <= value <= high else "yes")
        for slurry, values in reached.items()
        for value, (quantity, (low, high)) in zip(values, ranges.items(), strict=True)
    ]
    columns = results.training_range.columns.drop("role")
    entries = extrapolations(replace(results, training_range=pd.DataFrame(rows, columns=columns)))
    assert [entry["slurries"] for entry in entries] == [["2", "6"], ["7"], ["8"]]
    both, one, _ = ([quantity["name"].column for quantity in entry["quantities"]] for entry in entries)
    assert (both, one) == (["Particles"], ["Particles", "Density (g/cm³)"])
    (particles,) = entries[0]["quantities"]
    assert (list(particles["reached"]), list(particles["training"])) == ([200.0, 500.0], [100.0, 150.0])


def test_a_sound_run_has_no_notices(results):
    page = page_of(restricted(results, ["T1", "2", "N1"]))
    assert notices_of(page) == []
    assert "No warnings" in page.text
    assert "No predicted slurry lies outside" in page.text
    assert "Table S9" not in page.text


def test_training_range_is_that_of_each_model(results):
    """Radii and densities of phases are shown where a slurry is outside in one of them."""
    of_phase = results.training_range.assign(quantity="mean_radius_um_NiO", outside="no").drop_duplicates("slurry")
    of_model = results.training_range.assign(model="net", outside="no")
    of_model.loc[of_model.slurry == "2", "outside"] = "yes"
    page = page_of(replace(results, training_range=pd.concat([results.training_range, of_phase, of_model])))
    head = page.rows.index(["Slurry", "Particles", "Density (g/cm³)", "Number fraction, NiO"])
    slurries = ["2", "6", "N1"]
    assert [row[0] for row in page.rows[head + 1 :][:8]] == ["training", *slurries, "training of net", *slurries]
    assert any("training range of net" in notice for notice in notices_of(page))
    of_phase.loc[of_phase.slurry == "6", "outside"] = "yes"
    page = page_of(replace(results, training_range=pd.concat([results.training_range, of_phase])))
    assert any(row[-1] == "Mean radius, NiO (µm)" for row in page.rows)


def test_training_range_is_shown_where_a_slurry_is_outside(results):
    page = page_of(results)
    table = page.rows[page.rows.index(["Slurry", "Particles", "Density (g/cm³)", "Number fraction, NiO"]) + 1 :][:4]
    assert table == [
        ["training", "100", "1.45 to 1.55", "0.6000"],
        ["2", "100", "1.5", "0.6100"],
        ["6", "500 ▲", "1.4 ▼", "0.6100"],
        ["N1", "100", "1.5", "0.6100"],
    ]
    assert "No predicted slurry lies outside" not in page.text


def test_tapes_are_shown_from_their_pictures_to_their_pores(results):
    columns = ["source", "slurry", "stage", "quantity", "value", "unit", "dem_value", "replica_sd"]
    values = [("green_density", 3.0, "g/cm3"), ("shrinkage", 0.25, "1")]
    tapes = pd.DataFrame([("dem", "2", "tape", *value, value[1], np.nan) for value in values], columns=columns)
    ends = pd.DataFrame({"friction": [1.0, 0.1], "green_density_g_cm3": [2.9, 3.3], "packing_fraction": [0.5, 0.6]})
    stems = ["pores_2", "drying", "render_tape_2"]
    figures = dict.fromkeys(stems, results.figures["slurry_net_N1"]) | results.figures
    page = page_of(replace(results, microstructure=tapes, drying_calibration=ends, figures=figures))
    assert page.images == len(figures)
    captions = [text.split(" ")[2:4] for text in page.all("figcaption") if text.startswith("Fig. T")]
    assert captions == [["Slurry", "2"], ["Thickness,", "density"], ["Pore", "sizes"]]


def test_all_figures_of_a_run_with_new_slurries_only_are_shown(results):
    costs = results.costs[results.costs.stage != "train_surrogate"]
    figures = {stem: path for stem, path in results.figures.items() if stem != "coordinates_2"}
    config = adopting(results.config, "trained/model.keras")
    page = page_of(restricted(replace(results, costs=costs), ["N1"], config=config, figures=figures))
    assert page.images == len(figures)
    for expected in (
        "structures; there is no target",
        "there is no full DEM to compare with",
        "affine and net: 1 new; 100 particles in all",
        "2.2345",
    ):
        assert expected in page.text, expected
    assert "Fig. 6, above" not in page.text
    assert "– to –" not in page.text


def without_dem(results: Results) -> Results:
    """A run of one slurry and surrogate that took nothing from the DEM, and left out another one."""
    alone = restricted(results, ["N1"], surrogates=["affine"], left_out=["net"], networks={}, histories={})
    tables = {name: getattr(alone, name) for name in ("relaxation_ends", "density", "costs", "speedup")}
    tables = {name: table[table.surrogate.isin(["-", "affine"])] for name, table in tables.items()}
    tables["costs"] = tables["costs"][~tables["costs"].stage.isin(["run_slurry", "run_slurry_to_input"])]
    tables["speedup"] = tables["speedup"].assign(run_slurry_to_input=0.0, extract_frames=0.0)
    figures = {stem: results.figures[stem] for stem in ("workflow", "density", "rdf")}
    empty = {"runs": {}, "equilibrium": alone.equilibrium[:0], "training_range": None}
    return replace(alone, **tables, **empty, figures=figures)


@pytest.mark.parametrize(("measured", "shown"), [(None, "3.30"), (3.05, "0.234"), (2.5, "2.5")])
def test_summary_of_a_recipe_alone_says_what_its_friction_decides(results, measured, shown):
    rows = [
        ("slurry", "density", 2.2, "g/cm3"),
        ("tape", "green_density", 3.0, "g/cm3"),
        ("tape", "shrinkage", 0.25, "1"),
        ("tape", "share_void_union", 0.4, "1"),
    ]
    tapes = pd.DataFrame(rows, columns=["stage", "quantity", "value", "unit"])
    tapes = tapes.assign(source="affine", slurry="N1", dem_value=np.nan, replica_sd=np.nan)
    ends = [(1.0, 2.9, 0.5), (0.1, 3.3, 0.6)] + [(0.2341, 3.05, 0.55)] * (measured == 3.05)
    ends = pd.DataFrame(ends, columns=["friction", "green_density_g_cm3", "packing_fraction"])
    alone = without_dem(results)
    config = alone.config | {"drying": alone.config["drying"] | {"green_density_g_cm3": measured}}
    page = page_of(replace(alone, config=config, microstructure=tapes, drying_calibration=ends))
    assert shown in next(text for text in page.all("p") if text.startswith("Slurry N1 "))


def test_a_run_without_dem_says_nothing_of_one(results):
    alone = without_dem(results)
    page = page_of(alone)
    titles = [text for tag, text in page.blocks if tag == "h2"]
    assert titles[:4] == ["Summary", "New slurries", "End of the relaxation", "Cost"]
    assert not {"Hybrid against DEM", "DEM runs", "Training range"} & set(titles)
    assert page.images == len(alone.figures)
    assert notices_of(page) == [
        "Left out, as this run has no training slurries to learn from, or to take a packing fraction from: net."
    ]
    for row in (["N1", "affine", "1", "100", "2.2222", "-0.8%", "45.0"], ["affine", "0.5", "0.5", "0.5", "12", "20"]):
        assert row in page.rows
    for words in ("hybrid", "input frame", "simulated", "dem runs", "run_slurry"):
        assert words not in page.text.partition("Effective configuration")[0].lower(), words


def test_new_slurries_beside_others_point_to_the_figures_above(results):
    text = page_of(results).text
    assert text.count("Fig. 6.") == text.count("Fig. S2.") == 1
    assert text.index("Fig. S2.") < text.index("Fig. 6.") < text.index("Fig. 6, above")


def test_learning_curves_say_whose_weights_are_used(results):
    assert "at epoch 2, whose weights are used; in the last epoch it is" in page_of(results).text
    last = replace(results, weights_of={"net": "last"})
    assert "at epoch 2; in the last epoch, whose weights are used, it is" in page_of(last).text
    history = results.histories["net"].assign(val_loss=np.nan, val_mae=np.nan)
    text = page_of(replace(last, histories={"net": history})).text
    assert "no validation slurry. Training MSE goes from 3 to 0.4" in text


def test_a_training_that_ended_early_is_said_with_its_epochs(results):
    settings = {"epochs": 1000, "patience": 2, "min_improvement": 0.02, "batch_size": 10, "learning_rate": 1e-4}
    config = results.config | {"surrogate": results.config["surrogate"] | {"net": settings}}
    page = page_of(replace(results, config=config))
    assert (
        "before the 1,000 epochs that were allowed: its lowest validation MSE had fallen by no more than 2.0%"
        in page.text
    )
    assert ["Epochs, net", "3", "1,000"] in page.rows


@pytest.mark.parametrize("epochs", [0, 3])
def test_a_model_trained_elsewhere_is_said(results, epochs):
    history = {"net": results.histories["net"].iloc[:epochs]}
    config = adopting(results.config, "trained/model.keras")
    adopted = replace(restricted(results, ["2", "6", "N1"], histories=history, config=config), training_range=None)
    page = page_of(adopted)
    assert notices_of(page)[0].startswith("Surrogate net was trained elsewhere (trained/model.keras)")
    heads = {row[0].split(",")[0] for row in page.rows}
    assert not heads & {"Epochs", "Batch size", "Learning rate", "Samples (particles of the training slurries)"}
    for absent in ("training range 1", "No predicted slurry lies outside", "whose weights are used"):
        assert absent not in page.text, absent
    assert ("Learning curves of the adopted model" in page.text) == (epochs > 0)
    assert ("came without learning curves" in page.text) == (epochs == 0)
    assert "Their range is not known here" in page.text


def with_errors(results: Results, density: float, mse: float, rdf: float, wobble: float) -> Results:
    """Eight test slurries on which `net` has these times the errors of `affine`, give or take `wobble`, and a V1."""
    slurries = [*map(str, range(1, 9)), "V1"]
    scatter = np.resize([1 - wobble, 1 + wobble], len(slurries))
    scatter[-1] = 100.0  # of the validation slurry, which must not count
    rows = {"density": [], "coordinate_errors": [], "rdf_errors": []}
    for slurry, factor in zip(slurries, scatter, strict=True):
        rows["density"].append(("-", slurry, "DEM", 2.24, 100.0))
        for name, sizes in (("affine", (0.01, 0.1, 0.02)), ("net", (0.01 * density, 0.1 * mse, 0.02 * rdf))):
            errors = [value * (factor if name == "net" else 1.0) for value in sizes]
            rows["density"].append((name, slurry, "hybrid", 2.24 * (1 + errors[0]), 100.0))
            rows["coordinate_errors"] += [
                (name, slurry, axis, errors[1], 0.2, 0.99, errors[1], 0.2, 0.99) for axis in ("x", "y", "z", "all")
            ]
            rows["rdf_errors"].append((name, slurry, "all", 2.1, 36, errors[2]))
    tables = {name: pd.DataFrame(values, columns=getattr(results, name).columns) for name, values in rows.items()}
    test = results.equilibrium[results.equilibrium.slurry == "2"]
    roles = {slurry: "validation" if slurry == "V1" else "test" for slurry in slurries}
    rows_of_runs = [test.assign(slurry=slurry, role=role) for slurry, role in roles.items()]
    of_runs = {"inputs": dict.fromkeys(roles, results.inputs["2"]), "runs": dict.fromkeys(roles, results.runs["2"])}
    return replace(
        results,
        equilibrium=pd.concat(rows_of_runs, ignore_index=True),
        roles=roles,
        formulations=dict.fromkeys(roles, ""),
        expected_g_cm3=dict.fromkeys(roles, 2.24),
        **of_runs,
        **tables,
    )


@pytest.mark.parametrize(
    ("factors", "verdicts", "adds_nothing"),
    [
        ((0.5, 0.5, 0.5), ["better", "better", "better"], False),
        ((2, 2, 2), ["worse", "worse", "worse"], True),
        ((1, 0.5, 1), ["better", "not resolved", "not resolved"], True),
        ((2, 0.5, 1), ["better", "worse", "not resolved"], True),
    ],
)
def test_what_the_network_adds_is_said_either_way(results, factors, verdicts, adds_nothing):
    """In coordinates, density and RDF."""
    compared = with_errors(results, *factors, 0.1)
    (gain,) = gains_over_affine(compared)
    assert gain["mse_ratio"].mean() == pytest.approx(factors[1])
    assert list(gain["verdicts"].values()) == verdicts
    assert ("nothing shows that net is better than affine" in page_of(compared).text) == adds_nothing


def test_validation_slurries_are_shown_but_not_averaged(results):
    page = page_of(with_errors(results, 1, 0.5, 1, 0.1))
    assert "Not in them: the validation slurry V1" in page.text
    assert ["V1 (validation)", "0.1", "5", "0.9900", "0.9900", "–", "–"] in page.rows
    assert ["mean, test", "0.1", "0.05", "0.9900", "0.9900", "0.123", "0.996"] in page.rows


def test_too_few_slurries_are_not_judged(results):
    assert set(gains_over_affine(results)[0]["verdicts"].values()) == {None}
    assert "too few slurries to judge in coordinates, density, the RDF of all particles and" in page_of(results).text


def test_what_is_worse_comes_first():
    verdicts = {"a": "not resolved", "b": "better", "c": "not resolved", "d": "worse", "e": None}
    assert by_verdict(verdicts) == [("worse", ["d"]), ("better", ["b"]), ("not resolved", ["a", "c"]), (None, ["e"])]


def test_article_structures_are_the_published_ones():
    differences = article_structures().difference
    assert differences.abs().mean() == pytest.approx(0.15, abs=0.005)
    assert differences.abs().idxmax() == "6"
    assert differences["6"] == pytest.approx(0.54, abs=0.005)


@pytest.mark.parametrize(
    ("value", "form", "text"),
    [
        *((0.5, "duration", "0.5 s"), (180, "duration", "180 s"), (198, "duration", "3.3 min")),
        *((12600, "duration", "3.5 h"), (np.nan, "duration", "–"), (None, ".3g", "–"), (-0.0001, "z.2f", "0.00")),
        *((1234.5, "plain", "1,234"), (0.12345, "plain", "0.123"), ("none", ".3g", "none")),
        *((SlurryValue(0.012, "6"), ".1%", "1.2% (slurry 6)"), (pd.Series([1.0, 2.5]), "g", "1 to 2.5")),
    ],
)
def test_numbers(value, form, text):
    assert number(value, form) == text


def test_words():
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "<c>"]) == "a, b and &lt;c&gt;"
    assert named(["1"]) == "slurry 1"
    assert named(["1", "2"], "Slurry") == "Slurries 1 and 2"
    assert span(pd.Series([1.0, 2.5]), "g", " µs") == "1 to 2.5 µs"
    assert span(pd.Series([2.0, 2.0])) == "2"
    assert [time_unit(seconds)[1] for seconds in (10, 1000, 20000)] == ["s", "min", "h"]
