"""The page of the evaluation from small tables: verdicts in every direction, and a file that loads nothing."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imsave

from html_pages import Page
from script_runs import run_script
from slurrycast.evaluation.front import KEYS
from slurrycast.evaluation.verdicts import judge, judged_rows
from slurrycast.report import evaluation_statistics
from slurrycast.report.evaluation_results import Evaluation
from slurrycast.report.names import column_name, measure_name, quantity_name
from slurrycast.report.sections import evaluation_html
from slurrycast.report.verdict_statistics import (
    better_for_less,
    network_errors_at_equal_cost,
    network_skills,
    noise_verdicts,
)

TEST, VALIDATION = ["1", "2", "3", "6"], ["V1"]
ROLES = dict.fromkeys(TEST, "test") | dict.fromkeys(VALIDATION, "validation")
WOBBLE = {"1": 0.9, "2": 1.1, "3": 0.95, "6": 1.05, "V1": 1.0}
QUANTITIES = {"density_g_cm3": (2.24, 0.005), "coordination_all": (6.5, 0.05), "overlap_mean": (0.01, 0.001)}
SPREADS = {"rdf_all": 0.02, "rdf_NiO-8YSZ": 0.05}


CHEAPER, DEARER = "cheaper than any early_dem", "dearer than any early_dem"
ABSENT = "no early_dem of this slurry"


def structure_rows(surrogate: str, in_sd: float, slurries: list[str] | None = None) -> list[tuple]:
    """Relaxed structures that are `in_sd` replica sd from the DEM, give or take, and predicted ones five times that."""
    rows = []
    for slurry in slurries or [*TEST, *VALIDATION]:
        for stage, factor in (("predicted", 5.0), ("relaxed", 1.0)):
            off = in_sd * factor * WOBBLE[slurry]
            rows += [(surrogate, slurry, stage, name, m + off * sd, m, sd) for name, (m, sd) in QUANTITIES.items()]
            rows += [(surrogate, slurry, stage, name, off * spread, 0.0, spread) for name, spread in SPREADS.items()]
    return rows


def structure_table(in_sd: dict[str, float]) -> pd.DataFrame:
    rows = [row for surrogate, size in in_sd.items() for row in structure_rows(surrogate, size)]
    return pd.DataFrame(rows, columns=["surrogate", "slurry", "stage", "quantity", "value", "dem_value", "replica_sd"])


def verdict_table(structure_errors: pd.DataFrame) -> pd.DataFrame:
    return judge(judged_rows(structure_errors, TEST))


def with_structures(evaluation: Evaluation, structure_errors: pd.DataFrame) -> Evaluation:
    """The same with other structures, and the verdicts on them."""
    return replace(evaluation, structure_errors=structure_errors, verdicts=verdict_table(structure_errors))


def skill_table(skills: dict[str, float]) -> pd.DataFrame:
    rows = []
    for surrogate, skill in skills.items():
        for slurry, wobble in WOBBLE.items():
            own = 0.0 if surrogate == "affine" else skill + 0.1 * (wobble - 1)
            rows.append((surrogate, slurry, 0.1 - own * 0.0965, 0.1, 0.0035, own))
    return pd.DataFrame(rows, columns=["surrogate", "slurry", "mse_um2", "mse_affine_um2", "floor_um2", "skill"])


def equal_cost_table(ratio: float, notes: dict[str, str] | None = None) -> pd.DataFrame:
    """Errors of `net` as multiples of those of early_dem, which costs as much, or not as `notes` (by slurry) say."""
    factors = {CHEAPER: 2.0, DEARER: 0.5, ABSENT: np.nan}
    rows = []
    for slurry in TEST:
        note = (notes or {}).get(slurry, np.nan)
        factor = factors.get(note, 1.0)
        errors = np.array([0.08, 0.003, 0.02])
        pairs = np.ravel(np.column_stack([errors * ratio * WOBBLE[slurry], errors * (factor / factor)]))
        rows.append(("net", slurry, 0.2, 0.2 * factor, *pairs, note))
    errors = ("mse_um2", "density_error", "rdf_error")
    names = [column for name in errors for column in (name, f"early_dem_{name}")]
    columns = ["surrogate", "slurry", "cost_share_of_full_dem", "early_dem_cost_share", *names, "note"]
    return pd.DataFrame(rows, columns=columns)


@pytest.fixture
def evaluation(tmp_path) -> Evaluation:
    """A run in which everything but persistence and affine_f02 is about as good."""
    in_sd = {"persistence": 4.0, "affine": 1.0, "net": 0.9, "affine_f02": 1.5, "early_dem_x2": 0.5}
    noise = [
        (slurry, particles, name, 5, mean, sd)
        for slurry, particles in (("2", 600), ("6", 3001))
        for name, (mean, sd) in QUANTITIES.items()
    ]
    noise += [("2", 600, "rdf_all", 5, 0.02, 0.004), ("2", 600, "perturbation_floor_um2", 1, 0.0035, np.nan)]
    front = [
        (name, 2 if name.endswith("_f02") else 10, slurry, cost, 0.002 * in_sd[name], 0.02 * in_sd[name])
        for name, cost in (("persistence", 0.2), ("affine", 0.2), ("net", 0.3), ("affine_f02", 0.1))
        for slurry in WOBBLE
    ]
    scaling = {"slurries": 7, "fewest_particles": 600, "most_particles": 3001, "training_s": 360.0}
    scaling |= {"hybrid_exponent": 0.5, "hybrid_exponent_se": 0.04, "dem_exponent": 1.1, "dem_exponent_se": 0.02}
    pays = {"saved_s_per_slurry": 20.0, "slurries_to_pay_training": 18.0, "slurries_to_pay_training_and_dem": 31.0}
    figures = {}
    for stem in ("verdicts", "skill", "front", "uncertainty"):
        figures[stem] = tmp_path / f"{stem}.png"
        imsave(figures[stem], np.random.default_rng(0).random((20, 30, 3)))
    return Evaluation(
        run="unit",
        roles=ROLES | {"T1": "train"},
        networks=["net"],
        skill=skill_table({"affine": 0.0, "net": 0.0, "persistence": -2.0}),
        noise=pd.DataFrame(noise, columns=["slurry", "particles", "quantity", "runs", "mean", "sd"]),
        structure_errors=structure_table(in_sd),
        verdicts=verdict_table(structure_table(in_sd)),
        front=pd.DataFrame(front, columns=[*KEYS, "cost_share_of_full_dem", "density_error", "rdf_error"]),
        equal_cost=equal_cost_table(1.0),
        cost_scaling=pd.DataFrame(
            [{"surrogate": "net", "clock": clock} | scaling | pays for clock in ("wall_s", "cpu_s")]
        ),
        article_costs=pd.DataFrame(
            [(name, 7, "full DEM", "min", 1230.0, np.nan, ours) for name, ours in (("net", 0.48), ("affine", 0.47))],
            columns=["surrogate", "slurries", "term", "unit", "article", "article_says", "ours"],
        ),
        ablation=None,
        relaxation=None,
        uncertainty=None,
        tape_errors=None,
        tape_verdicts=None,
        figures=figures,
    )


def page_of(evaluation: Evaluation) -> Page:
    return Page(evaluation_html(evaluation))


@pytest.mark.parametrize(
    ("skill", "verdict", "words"),
    [
        (0.3, "better", "it adds to the"),
        (0.0, "not resolved", "no difference from the"),
        (-0.3, "worse", "it is worse than the"),
    ],
)
def test_skill_over_affine(evaluation, skill, verdict, words):
    evaluation = replace(evaluation, skill=skill_table({"affine": 0.0, "net": skill}))
    (entry,) = network_skills(evaluation)
    assert (entry["verdict"], entry["skills"].mean()) == (verdict, pytest.approx(skill, abs=1e-9))
    (sentence,) = [text for text in page_of(evaluation).all("li") if "mean skill" in text]
    assert f"net has a mean skill of {skill:.2f} over" in sentence and f"{words} affine map" in sentence


def test_without_a_floor_there_is_no_skill(evaluation):
    page = page_of(replace(evaluation, skill=skill_table({"net": 0.3}).assign(skill=np.nan)))
    assert "net: no test slurry has a skill." in page.all("li")


def equal_cost(evaluation: Evaluation, ratio: float, notes: dict[str, str] | None = None) -> tuple[list[dict], Page]:
    """What is compared with early_dem at these errors and notes, and the page that says it."""
    evaluation = replace(evaluation, equal_cost=equal_cost_table(ratio, notes))
    (entry,) = network_errors_at_equal_cost(evaluation)
    return entry["comparisons"], page_of(evaluation)


@pytest.mark.parametrize(("ratio", "verdict"), [(0.5, "better"), (1.0, "not resolved"), (2.0, "worse")])
def test_early_dem_at_equal_cost(evaluation, ratio, verdict):
    (comparison,), _ = equal_cost(evaluation, ratio)
    assert comparison["verdicts"] == [(verdict, ["coordinates", "density", "RDF"])]
    assert (comparison["note"], comparison["slurries"], comparison["cost"]) == ("", 4, pytest.approx(0.2))


def test_beyond_the_costs_of_early_dem_it_is_said_at_which_cost(evaluation):
    notes = dict.fromkeys(TEST[:3], CHEAPER) | {"6": DEARER}
    (cheaper, dearer), page = equal_cost(evaluation, 2.0, notes)
    assert [own["note"] for own in (cheaper, dearer)] == [CHEAPER, DEARER]
    assert [own["slurries"] for own in (cheaper, dearer)] == [3, 1]
    assert [own["early_dem_cost"] for own in (cheaper, dearer)] == pytest.approx([0.4, 0.1])
    assert [own["verdicts"][0][0] for own in (cheaper, dearer)] == ["worse", None]
    assert f"net is {CHEAPER} on 3 of 4 test slurries, 20.0% against 40.0%." in page.text
    assert "too few slurries to judge in coordinates, density and RDF" in page.text


def test_without_any_early_dem_nothing_is_compared(evaluation):
    _, page = equal_cost(evaluation, 1.0, dict.fromkeys(TEST, ABSENT))
    assert f"net cannot be compared with early_dem on any test slurry: {ABSENT}." in page.all("li")


def with_rival(evaluation, cost: float, gain_um2: list[float]) -> Evaluation:
    """The same with one without a network of such a cost, and an MSE that much below that of `net`, by slurry."""
    front = evaluation.front[evaluation.front.surrogate == "net"]
    front = front.assign(surrogate="rival", cost_share_of_full_dem=cost)
    skill = evaluation.skill[evaluation.skill.surrogate == "net"].set_index("slurry").loc[TEST].reset_index()
    skill = skill.assign(surrogate="rival", mse_um2=skill.mse_um2 - gain_um2)
    return replace(evaluation, front=pd.concat([evaluation.front, front]), skill=pd.concat([evaluation.skill, skill]))


@pytest.mark.parametrize(
    ("cost", "gain_um2", "better"),
    [
        (0.29, [0.01, 0.02, 0.01, 0.02], True),
        (0.31, [0.01, 0.02, 0.01, 0.02], False),  # dearer
        (0.29, [-0.01, -0.02, -0.01, -0.02], False),  # worse
        (0.29, [0.03, -0.02, 0.03, -0.02], False),  # not resolved
        (0.29, [0.01, 0.02, np.nan, np.nan], False),  # too few slurries to judge
        (0.29, [0.05, np.nan, np.nan, np.nan], False),  # a lower mean, over an easy slurry alone
    ],
)
def test_what_does_better_for_less_is_named(evaluation, cost, gain_um2, better):
    evaluation = with_rival(replace(evaluation, skill=skill_table({"affine": 0.0, "net": 0.2})), cost, gain_um2)
    (entry,) = better_for_less(evaluation)
    assert entry["network"] == ("net", pytest.approx(0.0807), pytest.approx(0.3))
    assert [label for label, _, _ in entry["better"]] == (["rival"] if better else [])
    text = page_of(evaluation).text
    assert ("Better than net (0.081 µm² at 30.0%)" in text) == better
    assert ("Nothing without a network is both better than net" in text) != better


def test_a_network_is_no_rival_of_another(evaluation):
    both = replace(with_rival(evaluation, 0.29, [0.01, 0.02, 0.01, 0.02]), networks=["net", "rival"])
    assert [(entry["network"][0], entry["better"]) for entry in better_for_less(both)] == [("net", []), ("rival", [])]


def test_surrogates_inside_the_noise_are_named(evaluation):
    """Off by 4 sd differs, by about 1 is equivalent, and by 1.5 with a single slurry far off is not resolved."""
    rows = evaluation.structure_errors
    scattered = (rows.surrogate == "affine_f02") & (rows.quantity == "coordination_all") & (rows.slurry == "1")
    rows = rows.assign(value=rows.value.where(~scattered, rows.value + 5 * rows.replica_sd))
    evaluation = with_structures(evaluation, rows)
    found = noise_verdicts(evaluation)
    assert found["inside"] == ["affine", "net", "early_dem_x2"]
    by_label = {row[0]: row[1:] for row in found["rows"]}
    worst = 4 * 1.1 * 0.005 / 2.24
    assert by_label["persistence"][:2] == [pytest.approx(4 * 0.005 / 2.24), (pytest.approx(worst), "2")]
    named = "density, coordination, overlap, RDF (2)"
    assert by_label["persistence"][2:] == [0, 0, 5, named, "RDF, all particles (+5.5)"]
    assert by_label["affine_f02"][2:] == [4, 1, 0, "coordination", "coordination, all particles (+2.7)"]
    page = page_of(evaluation)
    assert "Equivalent to the DEM in all judged measures: affine, net and early_dem_x2." in page.all("p")
    assert page.all("h2")[0] == "Inside the noise of the DEM?"


def test_page_begins_with_a_picture_the_verdict_and_its_table(evaluation, tmp_path):
    imsave(tmp_path / "slurry_net_2.png", np.zeros((20, 30, 3)))
    figures = evaluation.figures | {"slurry_net_2": tmp_path / "slurry_net_2.png"}
    html = evaluation_html(replace(evaluation, figures=figures, networks=["net", "other"]))
    expected = (
        "image/webp",
        "Equivalent to the DEM",
        "Table E1",
        "other is not in tables",
        "How it is judged",
        "Table E2",
    )
    places = [html.index(text) for text in expected]
    assert places == sorted(places)


def test_when_none_is_inside_the_noise_or_judged_the_page_says_so(evaluation):
    far = with_structures(evaluation, structure_table({"affine": 9.0, "net": 9.0}))
    rows = far.structure_errors
    partly = (rows.surrogate == "net") & (rows.quantity == "overlap_mean")
    far = with_structures(evaluation, rows.assign(value=rows.value.where(~partly, rows.dem_value)))
    assert noise_verdicts(far)["nearest"] == ("net", 1, 5)
    assert "No surrogate is equivalent to the DEM in all judged measures" in page_of(far).text
    rows = evaluation.structure_errors
    for unknown in (rows[rows.slurry.isin(["1", "2"])], rows.assign(replica_sd=np.nan)):
        evaluation = with_structures(evaluation, unknown)
        found = noise_verdicts(evaluation)
        assert (found["nearest"], found["inside"]) == (None, [])
        assert {tuple(row[3:]) for row in found["rows"]} == {(None, None, None, "", None)}
        assert "None is judged: that takes 3 test slurries" in page_of(evaluation).text


def test_a_surrogate_without_coordinates_has_all_but_a_skill(evaluation):
    """Like one that knows no places of single particles: structures and costs, no rows in skill.csv."""
    rows = pd.concat([evaluation.structure_errors, structure_table({"direct": 0.5})])
    front = evaluation.front[evaluation.front.surrogate == "net"].assign(
        surrogate="direct", cost_share_of_full_dem=0.05
    )
    beside = equal_cost_table(1.0).assign(surrogate="direct", mse_um2=np.nan)
    evaluation = replace(
        with_structures(evaluation, rows),
        networks=["net", "direct"],
        front=pd.concat([evaluation.front, front]),
        equal_cost=pd.concat([evaluation.equal_cost, beside]),
    )
    assert "direct" in noise_verdicts(evaluation)["inside"]
    assert [entry["verdict"] for entry in network_skills(evaluation)] == ["not resolved", None]
    (compared,) = network_errors_at_equal_cost(evaluation)[1]["comparisons"]
    assert [name for name, *_ in compared["errors"]] == ["density", "RDF"]
    assert [entry["network"][0] for entry in better_for_less(evaluation)] == ["net"]
    assert "direct: no test slurry has a skill." in page_of(evaluation).all("li")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "paid back after 18 slurries, with the DEM of the training slurries after 31"),
        ({"training_s": np.nan}, "time of its training is not known"),
        ({"saved_s_per_slurry": -20.0}, "never paid back, because the hybrid takes 20 s longer"),
        ({"saved_s_per_slurry": np.nan}, "no test slurry says when its training is paid back"),
        (
            {"hybrid_exponent": np.nan, "most_particles": 700},
            "7 slurries of 600 to 700 particles are too few or too alike",
        ),
    ],
)
def test_payback(evaluation, changes, words):
    text = page_of(replace(evaluation, cost_scaling=evaluation.cost_scaling.assign(**changes))).text
    assert words in text
    growth = "0.50 ± 0.04 for the hybrid and 1.10 ± 0.02 for the full DEM"
    assert (growth in text) == ("hybrid_exponent" not in changes)


def uncertainty_table(coverage: dict[str, float], correlation: float = 0.4) -> pd.DataFrame:
    """Two levels of `net`; coverage of the 90 % intervals by slurry, that of the 50 % ones a third of it."""
    columns = ["surrogate", "slurry", "role", "level", "factor", "coverage"]
    columns += ["rank_correlation", "mean_spread_um", "rms_error_um"]
    rows = [
        ("net", slurry, ROLES[slurry], *of_level, correlation * WOBBLE[slurry], 0.21, 0.345)
        for slurry, share in coverage.items()
        for of_level in ((0.5, 0.71, share / 3), (0.9, 1.87, share))
    ]
    return pd.DataFrame(rows, columns=columns)


COVERAGE = {"V1": 0.9, "1": 0.85, "2": 0.95, "3": 0.849, "6": 0.972}


@pytest.mark.parametrize(
    ("coverage", "correlation", "words"),
    [  # both ends count, the validation slurry does not
        (COVERAGE, 0.4, "on 2 of 4 test slurries (all: 84.9% to 97.2%)"),
        (COVERAGE, 0.4, "spread and its error is 0.36 to 0.44"),
        (COVERAGE, np.nan, "the spread ranks nothing"),
        ({"V1": 0.9}, 0.4, "have no test slurry to be judged on"),
    ],
)
def test_intervals_that_cover_what_they_should(evaluation, coverage, correlation, words):
    assert words in page_of(replace(evaluation, uncertainty=uncertainty_table(coverage, correlation))).text


def test_sections_without_a_table_are_left_out(evaluation):
    titles = page_of(evaluation).all("h2")
    assert len(titles) == 8
    more = {
        "ablation": pd.DataFrame({"surrogate": ["net"], "validation_mse_um2": [0.1]}),
        "relaxation": relaxation_table({"net": [True, True]}),
        "uncertainty": uncertainty_table(COVERAGE),
    }
    for name, table in more.items():
        assert len(page_of(replace(evaluation, **{name: table})).all("h2")) == 9


def test_no_negative_zero(evaluation):
    skill = evaluation.skill.assign(skill=-0.0001)
    assert "-0.00" not in evaluation_html(replace(evaluation, skill=skill))


def relaxation_table(within: dict[str, list[bool]]) -> pd.DataFrame:
    """tables/relaxation.csv: whether each surrogate is within the band after 500 and 3500 steps."""
    rows = [
        (name, "V1", steps, 0.012, -0.001, 1.2, 0.8, 2.3, steps / 500, inside)
        for name, those in within.items()
        for steps, inside in zip((500, 3500), those, strict=True)
    ]
    columns = ["surrogate", "slurry", "steps", "overlap_mean_predicted", "density_error", "density_in_sd"]
    return pd.DataFrame(rows, columns=[*columns, "rdf_in_spread", "coordination_in_sd", "cpu_s", "within_band"])


def test_steps_that_each_surrogate_needs(evaluation):
    within = {"persistence": [False, False], "affine": [True, True], "net": [False, True], "affine_f02": [True, True]}
    relaxed = replace(evaluation, relaxation=relaxation_table(within))
    assert evaluation_statistics.relaxation(relaxed)["enough"] == [
        (["500", "3,500"], ["affine", "affine_f02"]),
        (["3,500"], ["net"]),
        ([], ["persistence"]),
    ]
    page = page_of(relaxed)
    assert ["persistence", "1.20%", "1.2", "1.2", "0.8", "0.8", "2.3", "2.3", "1", "7", "none"] in page.rows
    assert ["net", "1.20%", "1.2", "1.2", "0.8", "0.8", "2.3", "2.3", "1", "7", "3,500"] in page.rows
    assert page.all("li").count("500 and 3,500 steps are enough for affine and affine_f02.") == 1
    assert page.all("li").count("None of these is enough for persistence.") == 1


def test_words():
    assert quantity_name("rdf_NiO-8YSZ") == "RDF, NiO-8YSZ"
    assert quantity_name("coordination_all") == "coordination, all particles"
    assert quantity_name("coarseness_2um_NiO_1") == "coarseness, NiO_1, 2 µm"
    assert measure_name("density_g_cm3") == "density"
    assert column_name("validation_mse_um2") == "validation mse (µm²)"
    assert column_name("slurries") == "slurries"
    frame = pd.DataFrame({"surrogate": ["a"], "training_s": [1234.5], "share": [0.12345]})
    table = evaluation_statistics.plain_table(frame)
    assert table["rows"] == [["a", "1,234", "0.123"]]
    assert table["columns"] == [("surrogate", "text"), ("training (s)", "plain"), ("share", "plain")]


def test_a_network_that_is_not_in_the_tables_is_noted(evaluation):
    assert "other is not in tables/structure_errors.csv." in page_of(
        replace(evaluation, networks=["net", "other"])
    ).all("li")


def test_page_from_files(tmp_path, evaluation):
    names = ("skill", "noise", "structure_errors", "verdicts", "front", "equal_cost", "cost_scaling")
    names += ("article_costs",)
    tables = {name: getattr(evaluation, name) for name in names}
    roles = pd.Series(evaluation.roles, name="role").rename_axis("slurry").reset_index()
    tables["equilibrium"] = roles.assign(warning="")
    ablation = {"surrogate": ["affine", "net"], "target": [None, "absolute"], "validation_mse_um2": [0.1, 0.0987]}
    tables["ablation"] = pd.DataFrame(ablation)
    tables["relaxation"] = relaxation_table({"affine": [True, True], "net": [False, True]})
    tables["uncertainty"] = uncertainty_table(COVERAGE)
    options = {"run": "unit", "networks": "net", "figures": [*evaluation.figures.values()]}
    for name, table in tables.items():
        options[name] = tmp_path / f"{name}.csv"
        table.to_csv(options[name], index=False)
    done = run_script("write_evaluation", **options, page=tmp_path / "evaluation.html")
    assert done.returncode == 0, done.stderr
    page = Page((tmp_path / "evaluation.html").read_text(encoding="utf-8"))
    assert page.images == 4
    assert page.loads_nothing
    assert ["net", "6", "test", "0.71", "32.4%", "1.87", "97.2%", "0.42", "0.21", "0.345"] in page.rows
    for expected in (
        "Equivalent to the DEM in all judged measures: affine, net",
        "affine_f02",
        "The lowest MSE on the validation slurries is that of net, 0.0987 µm²",
        "A perturbed run of slurry 2 ends 0.0035 µm² (MSE) away from it",
        "On the front of density error against cost: affine_f02, affine, net and the full DEM",
        "1,230",
        "paid back after 18 slurries",
        "500 and 3,500 steps are enough for affine",
        "on 2 of 4 test slurries (all: 84.9% to 97.2%)",
    ):
        assert expected in page.text, expected
