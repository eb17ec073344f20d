"""The report from small tables: numbers, sentences and a file that loads nothing from elsewhere."""

import json
import zipfile
from dataclasses import replace
from html.parser import HTMLParser

import h5py
import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imsave

from slurrycast.evaluation.speedup import HYBRID_PARTS, dem_seconds, time_unit
from slurrycast.evaluation.verdicts import TIE_RULE, judged, judged_list
from slurrycast.report import reference_article
from slurrycast.report.network_table import read_network
from slurrycast.report.page import duration, listed, span
from slurrycast.report.report import (
    Results,
    article_differences,
    extrapolations,
    gain_over_affine,
    relaxed_for,
    report_html,
    warnings,
)
from slurrycast.runtime.files import InputError

VOID_TAGS = {"meta", "img", "br", "hr", "link", "input"}

CONFIG = {
    "run": {"name": "unit"},
    "formulation": {
        "expected_density_g_cm3": 2.24,
        "unit_mass_pg": 100.0,
        "phases": {
            "NiO": {
                "mass_fraction": 0.6,
                "density_g_cm3": 6.67,
                "size_classes": [{"diameter_um": 0.6, "number_fraction": 1.0}],
            },
            "BDPD": {
                "mass_fraction": 0.4,
                "density_g_cm3": 0.8,
                "size_classes": [{"diameter_um": 1.1, "number_fraction": 1.0}],
            },
        },
    },
    "dem": {
        "timestep_us": 0.002,
        "steps": 1200,
        "frames": 121,
        "pressure_kpa": 101.325,
        "pressure_damping_us": 2e4,
        "temperature_k": 300,
        "ranks": 1,
    },
    "learning": {"input_frames": [7, 8, 9, 10], "target_frame": 120},
    "surrogate": {
        "names": ["affine", "net"],
        "model": None,
        "net": {"epochs": 3, "batch_size": 10, "learning_rate": 1e-4},
    },
    "relaxation": {"steps": 50},
    "analysis": {"rdf_cutoff_um": 7.0, "rdf_bins": 120},
}


class Page(HTMLParser):
    """Checks the nesting of tags and collects text and addresses."""

    def __init__(self):
        super().__init__()
        self.open, self.text, self.addresses, self.images = [], [], [], 0

    def handle_starttag(self, tag, attrs):
        if tag not in VOID_TAGS:
            self.open.append(tag)
        self.images += tag == "img"
        self.addresses += [value for name, value in attrs if name in ("src", "href", "srcset", "data", "action")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def read_page(html: str) -> Page:
    page = Page()
    page.feed(html)
    page.close()
    assert page.open == []
    return page


@pytest.fixture
def model(tmp_path):
    """A .keras file with one convolution and one dense layer."""
    layers = [
        ("InputLayer", {"batch_shape": [None, 3, 2]}),
        (
            "Conv1D",
            {
                "filters": 5,
                "kernel_size": [3],
                "strides": [1],
                "padding": "same",
                "use_bias": True,
                "activation": "relu",
            },
        ),
        ("MaxPooling1D", {"pool_size": [2], "strides": [2], "padding": "same"}),
        ("Flatten", {}),
        ("Dense", {"units": 3, "activation": "linear", "use_bias": True}),
        ("Unknown", {}),
    ]
    path = tmp_path / "model.keras"
    weights = tmp_path / "weights.h5"
    with h5py.File(weights, "w") as file:
        file["layers/conv1d/vars/0"] = np.zeros((3, 2, 5))
        file["layers/conv1d/vars/1"] = np.zeros(5)
        file["layers/dense/vars/0"] = np.zeros((10, 3))
        file["layers/dense/vars/1"] = np.zeros(3)
        file["optimizer/vars/0"] = np.zeros(999)
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
        | {"ratio_to_equilibrium": early / 20}
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
            "run_time_us": [2.4, 2.4, 2.4, 0.2],
            "warning": ["", "", "density drifts by <1 %> & more", ""],
        }
    )
    density = pd.DataFrame(
        [
            ("-", "T1", "DEM", 2.24, 44.6),
            ("-", "2", "DEM", 2.24, 44.6),
            ("-", "6", "DEM", 2.1, 238.1),
            ("net", "2", "hybrid", 2.2512, 44.4),
            ("net", "6", "hybrid", 2.31, 216.4),
            ("net", "N1", "hybrid", 2.2345, 44.7),
            ("affine", "2", "hybrid", 2.2624, 44.2),
            ("affine", "6", "hybrid", 2.163, 231.1),
            ("affine", "N1", "hybrid", 2.2222, 45.0),
        ],
        columns=["surrogate", "slurry", "model", "density_g_cm3", "volume_um3"],
    )
    values = {"2": (100, 1.5), "6": (500, 1.4), "N1": (100, 1.5)}
    training_range = pd.DataFrame(
        [
            (slurry, roles[slurry], *row)
            for slurry, (particles, density_g_cm3) in values.items()
            for row in (
                ("particles", particles, 100.0, 100.0, "yes" if slurry == "6" else "no"),
                ("density_g_cm3", density_g_cm3, 1.45, 1.55, "yes" if slurry == "6" else "no"),
                ("fraction_NiO", 0.61, 0.6, 0.6, "no"),
            )
        ],
        columns=["slurry", "role", "quantity", "value", "training_min", "training_max", "outside"],
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
    steps = np.where(costs.stage == "relax_slurry", np.where(costs.surrogate == "net", 2000, 3500), np.nan)
    costs = costs.assign(cpu_s=costs.wall_s, max_rss_mb=100.0, steps=steps)
    segments = [{"step_start": 0, "step_end": 600, "wall_s": 20.0, "cpu_s": 20.0}]
    segments += [{"step_start": 600, "step_end": 1200, "wall_s": 80.0, "cpu_s": 80.0}]
    start = {"wall_s": 0.0, "cpu_s": 0.0}
    run = {"start": start, "segments": segments, "steps": 1200, "lammps_version": "22 Jul 2025"}
    figures = {}
    stems = (
        "workflow",
        "learning_curves_net",
        "coordinates_2",
        "slurry_net_N1",
        "density",
        "rdf",
        "costs",
    )
    for stem in stems:
        figures[stem] = tmp_path / f"{stem}.png"
        imsave(figures[stem], np.random.default_rng(0).random((20, 30, 3)))
    return Results(
        config=CONFIG,
        config_text="run: {name: unit}",
        versions={"python": "3.11.7", "packages": {"keras": "3.15.1"}},
        inputs={slurry: {"mass_fractions_reached": {"NiO": 0.601, "BDPD": 0.399}} for slurry in roles},
        runs=dict.fromkeys(roles, run),
        density=density,
        coordinate_errors=coordinate_errors,
        rdf_errors=rdf_errors,
        equilibrium=equilibrium,
        training_range=training_range,
        costs=costs,
        speedup=speedup_table(surrogates),
        surrogates=surrogates,
        descriptions={name: (f"all that {name} may see", "last frame") for name in surrogates},
        histories={"net": history},
        networks={"net": read_network(model)},
        weights_of={"net": "lowest"},
        figures=figures,
    )


def restricted(results: Results, slurries: list[str], **changes: object) -> Results:
    """The same run with only some of its slurries; `-` stands for all of them."""
    tables = ("equilibrium", "density", "coordinate_errors", "rdf_errors", "costs", "speedup", "training_range")
    kept = {name: getattr(results, name)[getattr(results, name).slurry.isin([*slurries, "-"])] for name in tables}
    inputs = {slurry: results.inputs[slurry] for slurry in slurries}
    runs = {slurry: results.runs[slurry] for slurry in slurries}
    return replace(results, **kept, inputs=inputs, runs=runs, **changes)


def adopting(config: dict, path: str) -> dict:
    """The configuration with a model that was trained elsewhere."""
    return config | {"surrogate": config["surrogate"] | {"model": path}}


def text_of(results: Results) -> str:
    """What the report of a run says."""
    return " ".join("".join(read_page(report_html(results)).text).split())


def test_network_is_read_from_the_model_file(model):
    network = read_network(model)
    shapes = [layer.output_shape for layer in network.layers]
    assert shapes == [(3, 2), (3, 5), (2, 5), (10,), (3,), None]
    assert [layer.parameters for layer in network.layers] == [0, 35, 0, 0, 33, None]
    assert network.parameters == 68


def test_a_file_that_is_no_model_is_refused(tmp_path):
    path = tmp_path / "model.keras"
    path.write_text("not a zip")
    with pytest.raises(InputError, match=r"model\.keras"):
        read_network(path)


def test_dem_seconds_count_cut_segments_by_their_steps():
    segments = [(0, 100, 1.0), (100, 200, 1.0), (200, 400, 6.0)]
    run = {
        "start": {"wall_s": 0.5},
        "segments": [{"step_start": a, "step_end": b, "wall_s": s} for a, b, s in segments],
    }
    for steps, seconds in ((0, 0.5), (50, 1.0), (200, 2.5), (250, 4.0), (400, 8.5), (1000, 8.5)):
        assert dem_seconds(run, steps) == pytest.approx(seconds)


def test_report_holds_the_numbers_and_loads_nothing(results):
    page = read_page(report_html(results))
    text = " ".join("".join(page.text).split())
    for expected in (
        "2.2512",
        "2.2345",
        "0.123",
        "0.9876",
        "0.0217",
        "23,803,139",
        "2.1000",
        "0.6010",
        "3,500 of affine; 2,000 of net",
    ):
        assert expected in text, expected
    theirs = reference_article.COORDINATE_ERRORS["6"], reference_article.HYBRID_STRUCTURE["6"]
    for expected in (
        str(theirs[0].mse_um2),
        str(theirs[0].r2),
        f"{theirs[1].density_g_cm3:.4f}",
        "16,443",
        "1,230 min",
    ):
        assert expected in text, expected
    assert all(address.startswith(("#", "data:image/")) for address in page.addresses)
    assert page.images == len(results.figures)


@pytest.mark.parametrize(
    ("steps", "expected"),
    [
        ({"affine": 3500, "net": 2000}, "3,500 of affine; 2,000 of net"),
        ({"affine": 3500, "net": 3500}, "3,500"),
        ({"affine": 3500}, "3,500 of affine"),
        ({"affine": 3500, "net": np.nan}, "3,500 of affine"),
    ],
)
def test_steps_of_relaxation_are_said_once_or_by_surrogate(results, steps, expected):
    rows = pd.DataFrame({"surrogate": steps.keys(), "steps": steps.values()}).assign(stage="relax_slurry")
    assert relaxed_for(replace(results, costs=rows)) == expected


def test_report_escapes_what_it_is_given(results):
    html = report_html(results)
    assert "<1 %>" not in html
    assert "density drifts by <1 %> & more" in "".join(read_page(html).text)


def test_sentences_name_the_right_slurries(results):
    text = " ".join("".join(read_page(report_html(results)).text).split())
    assert "with net, the largest 0.21 g/cm³ (slurry 6, 10.0% denser than its DEM)" in text
    assert "With net, MSE is lowest for slurry 2 and highest for slurry 6" in text
    assert "at epoch 2, whose weights are used" in text
    assert "Not in equilibrium at its end: slurry 6" not in text  # no such figure in this run
    assert "The full DEM takes 5 (affine) and 5 (net) times as long as the hybrid run" in text
    assert "relaxation with net (60%)" in text


def test_warnings_come_from_the_data(results):
    notices = warnings(results)
    assert notices[0] == "Slurry 6: density drifts by <1 %> & more."
    assert "2.100 g/cm³" in notices[1]
    assert notices[2] == (
        "Slurry 6: 500 particles, training range 100; density at the last input frame 1.4 g/cm³, training range "
        "1.45 to 1.55; predictions of surrogates that learned extrapolate."
    )
    assert len(notices) == 3


def test_slurries_outside_in_the_same_quantities_share_a_warning(results):
    rows = [
        ("2", "particles", 200.0, 100.0, 150.0, "yes"),
        ("2", "density_g_cm3", 1.4, 1.3, 1.5, "no"),
        ("6", "particles", 500.0, 100.0, 150.0, "yes"),
        ("6", "density_g_cm3", 1.4, 1.3, 1.5, "no"),
        ("7", "particles", 400.0, 100.0, 150.0, "yes"),
        ("7", "density_g_cm3", 1.2, 1.3, 1.5, "yes"),
        ("8", "particles", 50.0, 100.0, 150.0, "yes"),
    ]
    columns = ["slurry", "quantity", "value", "training_min", "training_max", "outside"]
    both, one, smaller = extrapolations(replace(results, training_range=pd.DataFrame(rows, columns=columns)))
    said = "training range 100 to 150; predictions of surrogates that learned extrapolate."
    assert both == f"Slurries 2 and 6: 200 to 500 particles, {said}"
    assert smaller == f"Slurry 8: 50 particles, {said}"
    assert one.startswith("Slurry 7: 400 particles, training range 100 to 150; density at the last input frame 1.2 g")


def test_a_sound_run_has_no_warnings(results):
    sound = restricted(results, ["T1", "2", "N1"])
    assert warnings(sound) == []
    text = text_of(sound)
    assert "No warnings" in text
    assert "No predicted slurry lies outside the range of the training slurries." in text
    assert "Table S9" not in text


def test_training_range_is_shown_where_a_slurry_is_outside(results):
    text = text_of(results)
    assert text.index("Slurry 6: 500 particles, training range 100") < text.index("Key results")
    section = text[text.index("Table S9") :]
    assert section.index("Number fraction, NiO") < section.index("1.45 to 1.55")
    html = report_html(results)
    for row in (
        ("training", "100", "1.45 to 1.55", "0.6000"),
        ("2", "100", "1.5", "0.6100"),
        ("6", "500 ▲", "1.4 ▼", "0.6100"),
        ("N1", "100", "1.5", "0.6100"),
    ):
        first, *others = row
        assert f'<tr><td class="text">{first}</td>' + "".join(f'<td class="">{cell}</td>' for cell in others) in html
    assert "No predicted slurry lies outside" not in text


def test_all_figures_of_a_run_with_new_slurries_only_are_shown(results):
    costs = results.costs[results.costs.stage != "train_surrogate"]
    of_this_run = {stem: path for stem, path in results.figures.items() if stem != "coordinates_2"}
    config = adopting(results.config, "trained/model.keras")
    new = restricted(replace(results, costs=costs), ["N1"], config=config, figures=of_this_run)
    page = read_page(report_html(new))
    text = " ".join("".join(page.text).split())
    assert page.images == len(of_this_run)
    assert "No slurry of this run has a target to compare with" in text
    assert "structures; there is no target" in text
    assert "there is no full DEM to compare with" in text
    assert "Fig. 6, above" not in text
    assert "– to –" not in text
    assert "affine and net: 1 new; 100 particles in all" in text
    assert "2.2345" in text


def test_new_slurries_beside_others_point_to_the_figures_above(results):
    text = text_of(results)
    assert text.count("Fig. 6.") == text.count("Fig. S2.") == 1
    assert text.index("Fig. S2.") < text.index("Fig. 6.") < text.index("radial distribution functions in Fig. 6, above")


def test_learning_curves_say_whose_weights_are_used(results):
    assert "at epoch 2, whose weights are used; in the last epoch it is" in text_of(results)
    last = replace(results, weights_of={"net": "last"})
    assert "at epoch 2; in the last epoch, whose weights are used, it is" in text_of(last)
    history = results.histories["net"].assign(val_loss=np.nan, val_mae=np.nan)
    text = text_of(replace(last, histories={"net": history}))
    assert "There was no validation slurry. Training MSE goes from 3 to 0.4" in text


@pytest.mark.parametrize("epochs", [0, 3])
def test_a_model_trained_elsewhere_is_said(results, epochs):
    assert "Epochs, net" in text_of(results)
    history = {"net": results.histories["net"].iloc[:epochs]}
    config = adopting(results.config, "trained/model.keras")
    adopted = replace(restricted(results, ["2", "6", "N1"], histories=history, config=config), training_range=None)
    assert warnings(adopted)[0] == (
        "Surrogate net was trained elsewhere (trained/model.keras): neither its training range nor its recipe is known "
        "here."
    )
    text = text_of(adopted)
    for absent in (
        "Epochs, net",
        "Batch size, net",
        "Learning rate, net",
        "Samples (",
        "training range 1",
        "No predicted slurry lies outside",
    ):
        assert absent not in text, absent
    assert ("Learning curves of the adopted model" in text) == (epochs > 0)
    assert ("came without learning curves" in text) == (epochs == 0)
    assert "whose weights are used" not in text
    assert "their range is not known here, so whether a slurry lies outside is not checked." in text


def with_errors(results: Results, density: float, mse: float, rdf: float, wobble: float) -> Results:
    """Eight test slurries on which `net` has these times the errors of `affine`, give or take `wobble`, and a V1."""
    slurries = [*map(str, range(1, 9)), "V1"]
    scatter = np.resize([1 - wobble, 1 + wobble], len(slurries))
    scatter[-1] = 100.0  # of the validation slurry, which must not count
    rows = {"density": [], "coordinate_errors": [], "rdf_errors": []}
    for slurry, factor in zip(slurries, scatter, strict=True):
        rows["density"].append(("-", slurry, "DEM", 2.24, 100.0))
        for name, own in (("affine", (0.01, 0.1, 0.02)), ("net", (0.01 * density, 0.1 * mse, 0.02 * rdf))):
            errors = [value * (factor if name == "net" else 1.0) for value in own]
            rows["density"].append((name, slurry, "hybrid", 2.24 * (1 + errors[0]), 100.0))
            rows["coordinate_errors"] += [
                (name, slurry, axis, errors[1], 0.2, 0.99, errors[1], 0.2, 0.99) for axis in ("x", "y", "z", "all")
            ]
            rows["rdf_errors"].append((name, slurry, "all", 2.1, 36, errors[2]))
    tables = {name: pd.DataFrame(values, columns=getattr(results, name).columns) for name, values in rows.items()}
    test = results.equilibrium[results.equilibrium.slurry == "2"]
    roles = {slurry: "validation" if slurry == "V1" else "test" for slurry in slurries}
    rows_of_runs = [test.assign(slurry=slurry, role=role) for slurry, role in roles.items()]
    return replace(results, equilibrium=pd.concat(rows_of_runs, ignore_index=True), **tables)


@pytest.mark.parametrize(
    ("factors", "wobble", "short", "after"),
    [
        ((0.5, 0.5, 0.5), 0.1, "better in coordinates, density and the RDF of all particles.", ""),
        ((2, 2, 2), 0.1, "worse in coordinates, density and the RDF of all particles.", "adds nothing to affine"),
        (
            (1, 0.5, 1),
            0.1,
            "better in coordinates; a tie in density and the RDF of all particles.",
            "affine, which trains nothing, ties net",
        ),
        (
            (2, 0.5, 1),
            0.1,
            "worse in density; better in coordinates; a tie in the RDF of all particles.",
            "adds nothing to affine",
        ),
    ],
)
def test_what_the_network_adds_is_said_either_way(results, factors, wobble, short, after):
    sentences = gain_over_affine(with_errors(results, *factors, wobble), "net")
    assert f"is {factors[1]:.3g} times that of the affine map" in sentences[0]
    assert sentences[-2].startswith(f"In short, net against the affine map: {short}")
    assert after in sentences[-2]
    assert ("adds nothing" in sentences[-2] or "ties" in sentences[-2]) == bool(after)
    assert sentences[-1] == TIE_RULE


def test_validation_slurries_are_shown_but_not_averaged(results):
    validated = with_errors(results, 1, 0.5, 1, 0.1)
    text = text_of(validated)
    assert "V1 (validation)" in text
    assert "Not in them: the validation slurry V1" in text
    page = report_html(validated)
    assert '<td class="">0.05</td>' in page  # mean MSE of net, over the test slurries
    assert '<td class="">5</td>' in page  # that of V1, in its own row


def test_too_few_slurries_are_not_judged(results):
    sentences = gain_over_affine(results, "net")
    assert all("too few slurries to judge" in sentence for sentence in sentences[:4])


def test_verdicts():
    assert judged(pd.Series([-1.0, -1.1, -0.9])) == "better"
    assert judged(pd.Series([1.0, 1.1, 0.9, np.nan])) == "worse"
    assert judged(pd.Series([-1.0, 1.0, 0.5, -0.4])) == "tie"
    assert judged(pd.Series([-1.0, -1.1])) is None
    assert judged(pd.Series([-1.0, -1.1, np.nan])) is None
    verdicts = {"a": "tie", "b": "better", "c": "tie", "d": "worse"}
    assert judged_list(verdicts) == "worse in d; better in b; a tie in a and c"


def test_article_differences_are_the_published_ones():
    differences = article_differences()
    assert differences.abs().mean() == pytest.approx(0.15, abs=0.005)
    assert differences.abs().idxmax() == "6"
    assert differences["6"] == pytest.approx(0.54, abs=0.005)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.5, "0.5 s"), (180, "180 s"), (198, "3.3 min"), (12600, "3.5 h"), (np.nan, "–"), (None, "–")],
)
def test_durations(seconds, text):
    assert duration(seconds) == text


def test_words():
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert span(pd.Series([1.0, 2.5]), "g", " µs") == "1 to 2.5 µs"
    assert span(pd.Series([2.0, 2.0])) == "2"
    assert [time_unit(seconds)[1] for seconds in (10, 1000, 20000)] == ["s", "min", "h"]
