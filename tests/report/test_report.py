"""The report from small tables: numbers, conditions and a file that loads nothing from elsewhere."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from html_pages import Page
from slurrycast.evaluation.speedup import dem_seconds
from slurrycast.evaluation.verdicts import by_verdict
from slurrycast.report import reference_article
from slurrycast.report.results import Results
from slurrycast.report.sections import report_html
from slurrycast.report.statistics import article_structures, extrapolations, gains_over_affine


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
        ["Solvent, mass fraction of the BDPD", "0.594", "–"],
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


def test_costs_up_to_the_tape_are_means_over_the_slurries_that_are_dried(results):
    tapes = {"dry_slurry": [3.0, np.nan, np.nan], "measure_microstructure": [2.0, np.nan, np.nan]}
    tapes |= {"hybrid_to_tape": [25.0, np.nan, np.nan], "dem_to_tape": [105.0, np.nan, np.nan]}
    table = results.speedup.drop(columns="hybrid_to_tape")
    many = {name: values * (len(table) // 3) for name, values in tapes.items()}
    table = table.assign(**many, dem=table.dem.where(table.slurry != "6", 900.0))
    rows = page_of(replace(results, speedup=table)).rows
    assert ["net", "0.333", "0.05", "0.0333", "0.417", "1.67", "1.75"] in rows  # min
    assert any(row[0] == "net" and row[-2:] == ["8.33", "0.333"] for row in rows)  # of all test slurries


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
