"""The page of the evaluation from small tables: verdicts in every direction, and a file that loads nothing."""

import json
import re
import sys
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imsave

import write_evaluation
from slurrycast.evaluation.verdicts import deviations, quantity_name
from slurrycast.report.evaluation_report import (
    Evaluation,
    better_for_less_sentences,
    equal_cost_sentences,
    evaluation_html,
    heading,
    payback_sentences,
    plain_table,
    relaxation_section,
    relaxation_sentence,
    skill_sentences,
    tie_sentences,
    tolerance_sentences,
    uncertainty_sentences,
)

TEST, VALIDATION = ["1", "2", "3", "6"], ["V1"]
ROLES = dict.fromkeys(TEST, "test") | dict.fromkeys(VALIDATION, "validation")
WOBBLE = {"1": 0.9, "2": 1.1, "3": 0.95, "6": 1.05, "V1": 1.0}
QUANTITIES = {"density_g_cm3": (2.24, 0.005), "coordination_all": (6.5, 0.05), "overlap_mean": (0.01, 0.001)}
SPREADS = {"rdf_all": 0.02, "rdf_NiO-8YSZ": 0.05}


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
    rows = [row for surrogate, own in in_sd.items() for row in structure_rows(surrogate, own)]
    return pd.DataFrame(rows, columns=["surrogate", "slurry", "stage", "quantity", "value", "dem_value", "replica_sd"])


def skill_table(skills: dict[str, float]) -> pd.DataFrame:
    rows = []
    for surrogate, skill in skills.items():
        for slurry, wobble in WOBBLE.items():
            own = 0.0 if surrogate == "affine" else skill + 0.1 * (wobble - 1)
            rows.append((surrogate, slurry, 0.1 - own * 0.0965, 0.1, 0.0035, own))
    return pd.DataFrame(rows, columns=["surrogate", "slurry", "mse_um2", "mse_affine_um2", "floor_um2", "skill"])


def equal_cost_table(ratio: float, notes: dict[str, str] | None = None) -> pd.DataFrame:
    """Errors of `net` as multiples of those of early_dem, which costs as much, or not as `notes` (by slurry) say."""
    factors = {
        "cheaper than any early_dem": 2.0,
        "dearer than any early_dem": 0.5,
        "no early_dem of this slurry": np.nan,
    }
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
    for stem in ("skill", "structure", "front", "uncertainty"):
        figures[stem] = tmp_path / f"{stem}.png"
        imsave(figures[stem], np.random.default_rng(0).random((20, 30, 3)))
    return Evaluation(
        run="unit",
        roles=ROLES | {"T1": "train"},
        networks=["net"],
        density_tolerance=0.01,
        rdf_tolerance=2.0,
        relaxed_for=dict.fromkeys(("persistence", "affine", "affine_f02", "early_dem_x2"), 3500) | {"net": 2000},
        skill=skill_table({"affine": 0.0, "net": 0.0, "persistence": -2.0}),
        noise=pd.DataFrame(noise, columns=["slurry", "particles", "quantity", "runs", "mean", "sd"]),
        structure_errors=structure_table(in_sd),
        front=pd.DataFrame(
            front,
            columns=[
                *("surrogate", "input_last_frame", "slurry"),
                *("cost_share_of_full_dem", "density_error", "rdf_error"),
            ],
        ),
        equal_cost=equal_cost_table(1.0),
        cost_scaling=pd.DataFrame(
            [{"surrogate": "net", "clock": clock} | scaling | pays for clock in ("wall_s", "cpu_s")]
        ),
        article_costs=pd.DataFrame(
            [
                ("net", 7, "full DEM", "min", 1230.0, np.nan, 0.48),
                ("affine", 7, "full DEM", "min", 1230.0, np.nan, 0.47),
            ],
            columns=["surrogate", "slurries", "term", "unit", "article", "article_says", "ours"],
        ),
        ablation=None,
        relaxation=None,
        uncertainty=None,
        figures=figures,
    )


@pytest.mark.parametrize(
    ("skill", "words"),
    [
        (0.3, "it adds to the affine map"),
        (0.0, "it ties the affine map"),
        (-0.3, "it is worse than the affine map"),
    ],
)
def test_skill_over_affine(evaluation, skill, words):
    (sentence,) = skill_sentences(replace(evaluation, skill=skill_table({"affine": 0.0, "net": skill})))
    assert words in sentence
    assert f"mean skill of {skill:.2f} over the test slurries" in sentence


def test_without_a_floor_there_is_no_skill(evaluation):
    table = skill_table({"net": 0.3}).assign(skill=np.nan)
    assert skill_sentences(replace(evaluation, skill=table)) == ["net: no test slurry has a skill."]


@pytest.mark.parametrize(
    ("ratio", "words"),
    [
        (0.5, "better in coordinates, density and RDF"),
        (1.0, "a tie in coordinates, density and RDF"),
        (2.0, "worse in coordinates, density and RDF"),
    ],
)
def test_early_dem_at_equal_cost(evaluation, ratio, words):
    (sentence,) = equal_cost_sentences(replace(evaluation, equal_cost=equal_cost_table(ratio)))
    assert f"at equal cost, 20.0% of the full DEM, on 4 of 4 test slurries: {words}" in sentence


def test_beyond_the_costs_of_early_dem_it_is_said_at_which_cost(evaluation):
    notes = dict.fromkeys(TEST[:3], "cheaper than any early_dem") | {"6": "dearer than any early_dem"}
    cheaper, dearer = equal_cost_sentences(replace(evaluation, equal_cost=equal_cost_table(2.0, notes)))
    assert cheaper.startswith(
        "net is cheaper than any early_dem on 3 of 4 test slurries, 20.0% of the full DEM against 40.0%; beside the "
        "nearest: worse in coordinates, density and RDF"
    )
    assert dearer.startswith(
        "net is dearer than any early_dem on 1 of 4 test slurries, 20.0% of the full DEM against 10.0%; beside the "
        "nearest: too few slurries to judge in coordinates, density and RDF"
    )


def with_rival(evaluation, cost: float, gain_um2: list[float]) -> Evaluation:
    """The same with one without a network of such a cost, and an MSE that much below that of `net`, by slurry."""
    front = evaluation.front[evaluation.front.surrogate == "net"]
    front = front.assign(surrogate="rival", cost_share_of_full_dem=cost)
    own = evaluation.skill[evaluation.skill.surrogate == "net"].set_index("slurry").loc[TEST].reset_index()
    skill = own.assign(surrogate="rival", mse_um2=own.mse_um2 - gain_um2)
    return replace(evaluation, front=pd.concat([evaluation.front, front]), skill=pd.concat([evaluation.skill, skill]))


@pytest.mark.parametrize(
    ("cost", "gain_um2", "better"),
    [
        (0.29, [0.01, 0.02, 0.01, 0.02], True),
        (0.31, [0.01, 0.02, 0.01, 0.02], False),  # dearer
        (0.29, [-0.01, -0.02, -0.01, -0.02], False),  # worse
        (0.29, [0.03, -0.02, 0.03, -0.02], False),  # a tie
        (0.29, [0.01, 0.02, np.nan, np.nan], False),  # too few slurries to judge
    ],
)
def test_what_does_better_for_less_is_named(evaluation, cost, gain_um2, better):
    evaluation = with_rival(replace(evaluation, skill=skill_table({"affine": 0.0, "net": 0.2})), cost, gain_um2)
    (sentence,) = better_for_less_sentences(evaluation)
    if better:
        assert sentence == "Better than net (0.081 µm² at 30.0%), and for less: rival (0.066 µm² at 29.0%)."
    else:
        assert sentence == (
            "Nothing without a network predicts coordinates better than net (0.081 µm² at 30.0%) for less."
        )


def test_a_network_is_no_rival_of_another(evaluation):
    both = replace(with_rival(evaluation, 0.29, [0.01, 0.02, 0.01, 0.02]), networks=["net", "rival"])
    one, other = better_for_less_sentences(both)
    assert one.startswith("Nothing") and "than net (" in one
    assert other.startswith("Nothing") and "than rival (" in other


def test_rivals_are_compared_on_the_slurries_that_both_have(evaluation):
    """One that is only there for a slurry on which all are good is no better for that."""
    evaluation = replace(evaluation, skill=skill_table({"affine": 0.0, "net": 0.2}))
    easy = with_rival(evaluation, 0.29, [0.05, np.nan, np.nan, np.nan])
    assert easy.skill[easy.skill.surrogate == "rival"].mse_um2.mean() < 0.05
    assert better_for_less_sentences(easy)[0].startswith("Nothing")


@pytest.mark.parametrize("label", ["early_dem_x2", "driven_dem"])
def test_best_of_those_that_do_not_go_on_with_the_dem_leaves_out_all_that_do(evaluation, label):
    """It has the lowest density error of all, and is not the best of the others."""
    table = structure_table({"affine": 1.0, "net": 0.9, label: 0.1})
    (
        one,
        *_,
    ) = tolerance_sentences(replace(evaluation, structure_errors=table))
    assert one.startswith(f"{label} has the lowest mean density error") and "of all surrogates" in one
    others = [
        said for said in tolerance_sentences(replace(evaluation, structure_errors=table)) if "do not go on" in said
    ]
    assert [said.split()[0] for said in others] == ["net"]


def test_without_any_early_dem_nothing_is_compared(evaluation):
    notes = dict.fromkeys(TEST, "no early_dem of this slurry")
    (sentence,) = equal_cost_sentences(replace(evaluation, equal_cost=equal_cost_table(1.0, notes)))
    assert sentence == "net cannot be compared with early_dem on any test slurry: no early_dem of this slurry."


ALL_GROUPS = "density, RDF, contacts and mean overlap"


@pytest.mark.parametrize(
    ("network", "affine", "words", "within"),
    [
        (1.0, 1.0, f"After relaxation affine ties net in {ALL_GROUPS}. ", ALL_GROUPS),
        (0.6, 1.7, f"After relaxation, net against affine: better in {ALL_GROUPS}. ", ALL_GROUPS),
        (2.5, 0.5, f"After relaxation net adds nothing to affine: worse in {ALL_GROUPS}. ", "none of them"),
    ],
)
def test_affine_and_relaxation_against_the_network(evaluation, network, affine, words, within):
    structure_errors = structure_table({"affine": affine, "net": network})
    (sentence,) = tie_sentences(replace(evaluation, structure_errors=structure_errors))
    assert sentence.startswith(words)
    assert f"density {network:.2g} and {affine:.2g}" in sentence
    assert sentence.endswith(f"Both are within the noise of the DEM, 2 of these, in: {within}.")


def test_a_small_difference_on_every_slurry_is_no_tie_and_a_large_one_on_some_is(evaluation):
    rows = structure_table({"affine": 1.0, "net": 1.1})
    (sentence,) = tie_sentences(replace(evaluation, structure_errors=rows))
    assert f"worse in {ALL_GROUPS}" in sentence
    scattered = rows[(rows.surrogate == "net") & rows.slurry.isin(["1", "2"])].index
    rows.loc[scattered, "value"] = rows.dem_value + 0.1 * (rows.value - rows.dem_value)
    (sentence,) = tie_sentences(replace(evaluation, structure_errors=rows))
    assert f"ties net in {ALL_GROUPS}" in sentence


def test_what_is_worse_comes_first(evaluation):
    rows = structure_table({"affine": 1.0, "net": 0.5})
    density = (rows.surrogate == "net") & (rows.quantity == "density_g_cm3")
    rows.loc[density, "value"] = rows.dem_value + 6 * (rows.value - rows.dem_value)
    (sentence,) = tie_sentences(replace(evaluation, structure_errors=rows))
    assert "net against affine: worse in density; better in RDF, contacts and mean overlap." in sentence


def test_a_tie_takes_three_slurries(evaluation):
    rows = evaluation.structure_errors
    (sentence,) = tie_sentences(replace(evaluation, structure_errors=rows[rows.slurry.isin(["1", "2"])]))
    assert sentence.startswith("After relaxation, net against affine: too few slurries to judge. ")


def test_packing_and_the_largest_overlap_are_not_averaged(evaluation):
    rows = evaluation.structure_errors
    extra = rows[rows.quantity == "overlap_mean"]
    others = [extra.assign(quantity=name, value=1e3) for name in ("overlap_max", "packing_nominal", "packing_union")]
    assert tie_sentences(replace(evaluation, structure_errors=pd.concat([rows, *others]))) == tie_sentences(evaluation)


def test_without_replicas_nothing_is_in_their_units(evaluation):
    unknown = replace(evaluation, structure_errors=evaluation.structure_errors.assign(replica_sd=np.nan))
    (sentence,) = tie_sentences(unknown)
    assert sentence.endswith("How much that is against the scatter of replicas is not known.")
    assert "no test slurry to judge it on" in tolerance_sentences(unknown)[2]
    assert "is not known" in evaluation_html(unknown)


def test_bars_are_met_by_the_best_of_the_validation_slurries(evaluation):
    sentences = tolerance_sentences(evaluation)
    assert sentences[0] == (
        "early_dem_x2 has the lowest mean density error after relaxation on the validation slurries, of all surrogates."
    )
    assert sentences[3].startswith("net has the lowest mean density error")
    worst = 0.9 * 1.1 * 0.005 / 2.24
    assert sentences[4] == (
        f"Density error of net, at most 1.00% wanted: met on all 4 test slurries, at most {worst:.2%} (slurry 2)."
    )
    assert "met for all pairs on all 4 test slurries, at most 0.99" in sentences[5]


def test_missed_bars_are_named(evaluation):
    rows = structure_table({"net": 1.0})
    density = (rows.slurry == "6") & (rows.quantity == "density_g_cm3") & (rows.stage == "relaxed")
    rdf = (rows.slurry == "2") & (rows.quantity == "rdf_NiO-8YSZ") & (rows.stage == "relaxed")
    rows.loc[density, "value"] = 2.24 * 0.97
    rows.loc[rdf, "value"] = 0.05 * 3.21
    sentences = tolerance_sentences(replace(evaluation, structure_errors=rows))
    assert len(sentences) == 3  # no early_dem: one choice
    assert "met on 3 of 4 test slurries, missed on slurry 6 (3.00%)" in sentences[1]
    assert "met in 7 of 8 cases (pair and test slurry), missed for NiO-8YSZ on slurry 2 (3.21)" in sentences[2]


def test_without_validation_slurries_the_choice_is_said_to_be_the_tests(evaluation):
    roles = dict.fromkeys(TEST, "test")
    assert tolerance_sentences(replace(evaluation, roles=roles))[0].endswith(
        "on the test slurries, of all surrogates; without validation slurries it was picked on those it is judged on."
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "its training is paid back after 18 slurries, with the DEM of the training slurries after 31"),
        ({"training_s": np.nan}, "what its training took is not known"),
        ({"saved_s_per_slurry": -20.0}, "its training is never paid back: the hybrid takes 20 s longer"),
        ({"saved_s_per_slurry": np.nan}, "no test slurry says when its training is paid back"),
    ],
)
def test_payback(evaluation, changes, words):
    (sentence,) = payback_sentences(replace(evaluation, cost_scaling=evaluation.cost_scaling.assign(**changes)))
    assert sentence.startswith(f"With net, {words}")
    assert "to the 0.50 ± 0.04, of the full DEM to the 1.10 ± 0.02" in sentence


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


def test_intervals_that_cover_what_they_should(evaluation):
    """Both ends count, the validation slurry does not."""
    (sentence,) = uncertainty_sentences(replace(evaluation, uncertainty=uncertainty_table(COVERAGE)))
    assert sentence == (
        "The 90% intervals of net, calibrated on the validation slurries, cover 85% to 95% of the coordinates on 2 of "
        "4 test slurries (all: 84.9% to 97.2%), and the rank correlation of a particle's spread and its error is 0.36 "
        "to 0.44."
    )


def test_a_spread_that_is_the_same_everywhere_ranks_nothing(evaluation):
    (sentence,) = uncertainty_sentences(replace(evaluation, uncertainty=uncertainty_table(COVERAGE, np.nan)))
    assert sentence.endswith("and no test slurry has particles of different spread, so it ranks nothing.")


def test_intervals_without_a_test_slurry(evaluation):
    table = uncertainty_table({"V1": 0.9})
    (sentence,) = uncertainty_sentences(replace(evaluation, uncertainty=table))
    assert sentence.endswith("calibrated on the validation slurries, have no test slurry to be judged on.")


def test_without_a_spread_there_is_no_uncertainty(evaluation):
    assert "Uncertainty" not in evaluation_html(evaluation)
    assert "Uncertainty" in evaluation_html(replace(evaluation, uncertainty=uncertainty_table(COVERAGE)))


def test_without_exponents_nothing_is_said_to_grow(evaluation):
    unknown = evaluation.cost_scaling.assign(hybrid_exponent=np.nan, most_particles=700)
    (sentence,) = payback_sentences(replace(evaluation, cost_scaling=unknown))
    assert sentence.endswith(
        "7 slurries of 600 to 700 particles are too few or too alike to say how cost grows with size."
    )


def test_no_negative_zero(evaluation):
    skill = evaluation.skill.assign(skill=-0.0001)
    assert "-0.00" not in evaluation_html(replace(evaluation, skill=skill))


def test_deviations():
    table = pd.DataFrame({"value": [1.0, 1.0, 1.0], "dem_value": [1.5, 1.5, 0.0], "replica_sd": [0.25, 0.0, np.nan]})
    found = deviations(table)
    assert found.deviation.tolist() == [0.5, 0.5, 1.0]
    assert found.in_sd[0] == 2.0
    assert found.in_sd[1:].isna().all()


def relaxation_table(within: dict[str, list[bool]]) -> pd.DataFrame:
    """tables/relaxation.csv: whether each surrogate is within the band after 500 and 3500 steps."""
    rows = [
        (name, "V1", steps, 0.012, -0.001, 1.2, 0.8, steps / 500, inside)
        for name, those in within.items()
        for steps, inside in zip((500, 3500), those, strict=True)
    ]
    columns = ["surrogate", "slurry", "steps", "overlap_mean_predicted", "density_error", "density_in_sd"]
    return pd.DataFrame(rows, columns=[*columns, "rdf_in_spread", "cpu_s", "within_band"])


def test_steps_that_each_surrogate_needs(evaluation):
    within = {"persistence": [False, False], "affine": [True, True], "net": [False, True], "affine_f02": [True, True]}
    relaxed = replace(evaluation, relaxation=relaxation_table(within))
    assert relaxation_sentence(relaxed) == (
        "Steps of relaxation, of 500 and 3,500, after which the density is within 2 replica sd and the RDF within 2 "
        "replica spreads of the DEM, for validation slurry V1: 500 and 3,500 for affine and affine_f02; 3,500 for net; "
        "none of them for persistence."
    )
    section = relaxation_section(relaxed)
    assert section.blocks[-1].rows[0] == ["persistence", "1.20%", "1.2", "1.2", "0.8", "0.8", "1", "7", "none"]
    assert section.blocks[-1].rows[2][-1] == "3,500"
    assert sum(width for _, width in section.blocks[-1].groups) == len(section.blocks[-1].columns)
    assert section.title in evaluation_html(relaxed)


def test_without_validation_slurries_the_section_is_left_out(evaluation):
    assert relaxation_section(evaluation) is None
    assert "Physics in the loop" not in evaluation_html(evaluation)


def test_words():
    assert quantity_name("rdf_NiO-8YSZ") == "RDF, NiO-8YSZ"
    assert quantity_name("coordination_all") == "coordination, all particles"
    assert heading("validation_mse_um2") == "validation mse (µm²)"
    assert heading("slurries") == "slurries"
    table = plain_table("T", "", pd.DataFrame({"surrogate": ["a"], "training_s": [1234.5], "share": [0.12345]}))
    assert table.rows == [["a", "1,234", "0.123"]]
    assert table.columns == ["surrogate", "training (s)", "share"]


class Addresses(HTMLParser):
    """Collects what a page refers to, and its pictures."""

    def __init__(self):
        super().__init__()
        self.found, self.images = [], 0

    def handle_starttag(self, tag, attrs):
        self.images += tag == "img"
        self.found += [value for name, value in attrs if name in ("src", "href", "srcset", "data")]


def test_page_from_files(tmp_path, evaluation, monkeypatch):
    tables = {
        name: getattr(evaluation, name)
        for name in ("skill", "noise", "structure_errors", "front", "equal_cost", "cost_scaling", "article_costs")
    }
    roles = pd.Series(evaluation.roles, name="role").rename_axis("slurry").reset_index()
    tables["equilibrium"] = roles.assign(warning="")
    ablation = {"surrogate": ["affine", "net"], "target": [None, "absolute"], "validation_mse_um2": [0.1, 0.0987]}
    tables["ablation"] = pd.DataFrame(ablation)
    tables["relaxation"] = relaxation_table({"affine": [True, True], "net": [False, True]})
    tables["uncertainty"] = uncertainty_table(COVERAGE)
    words = [
        "write_evaluation",
        "--run",
        "unit",
        "--networks",
        "net",
        "--density-tolerance",
        "0.01",
        "--rdf-tolerance",
        "2",
    ]
    words += ["--relaxed-for", json.dumps(evaluation.relaxed_for)]
    for name, table in tables.items():
        table.to_csv(tmp_path / f"{name}.csv", index=False)
        words += [f"--{name.replace('_', '-')}", str(tmp_path / f"{name}.csv")]
    page = tmp_path / "evaluation.html"
    words += ["--figures", *map(str, evaluation.figures.values()), "--page", str(page)]
    monkeypatch.setattr(sys, "argv", words)
    write_evaluation.main()
    html = page.read_text(encoding="utf-8")
    addresses = Addresses()
    addresses.feed(html)
    assert addresses.images == 4
    assert all(address.startswith(("#", "data:image/")) for address in addresses.found)
    text = " ".join(re.sub(r"<[^>]+>", " ", html).split())
    for expected in (
        "After relaxation, net against affine: better in density, RDF, contacts and mean overlap",
        "affine_f02",
        "The lowest MSE on the validation slurries is that of net, 0.0987 µm²",
        "A perturbed run of slurry 2 ends 0.0035 µm² (MSE) away from it",
        "On that of density error against cost: affine_f02, affine, net and the full DEM",
        "1,230",
        "paid back after 18 slurries",
        "500 and 3,500 for affine; 3,500 for net",
        "on 2 of 4 test slurries (all: 84.9% to 97.2%)",
        "net 6 test 0.71 32.4% 1.87 97.2% 0.42 0.21 0.345",
    ):
        assert expected in text, expected
