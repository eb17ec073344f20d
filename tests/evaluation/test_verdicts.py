"""What is inside the noise: known cases, Holm's correction, and how often noise alone gets a verdict."""

import numpy as np
import pandas as pd
import pytest

import plot_verdicts
from pictures import is_drawn, recorded_calls, texts
from script_runs import run_script, written
from slurrycast.evaluation.noise import rdf_spread
from slurrycast.evaluation.verdicts import (
    COLUMNS,
    DIFFERS,
    EQUIVALENT,
    FAMILY_LEVEL,
    MEASURES,
    NOT_RESOLVED,
    RDF_BAND,
    compare,
    holm,
    in_noise,
    judge,
    judged_rows,
    mean_difference,
)

SLURRIES = [str(number) for number in range(1, 8)]
# t interval of seven values at 90 %, in units of their standard error
T90 = 1.943180


def errors(differences: dict[tuple[str, str], list[float]]) -> pd.DataFrame:
    """Rows of relaxed structures whose values are that many replica sd of 0.01 from a DEM value of 2."""
    rows = [
        (surrogate, slurry, "relaxed", quantity, 2 + 0.01 * difference, 2.0, 0.01)
        for (surrogate, quantity), of_slurries in differences.items()
        for slurry, difference in zip(SLURRIES, of_slurries, strict=False)
    ]
    columns = ["surrogate", "slurry", "stage", "quantity", "value", "dem_value", "replica_sd"]
    return pd.DataFrame(rows, columns=columns)


def around(mean: float, sd: float, n: int = 7) -> list[float]:
    """n values with exactly this mean and standard deviation."""
    values = np.linspace(-1, 1, n)
    return list(mean + sd * values / values.std(ddof=1))


def test_interval_and_p_of_a_mean():
    number, mean, lower, upper, p = mean_difference([*around(1.5, 0.7), np.nan])
    assert (number, mean) == (7, pytest.approx(1.5))
    assert [lower, upper] == pytest.approx([1.5 - T90 * 0.7 / 7**0.5, 1.5 + T90 * 0.7 / 7**0.5])
    assert mean_difference(around(T90 / 7**0.5, 1.0)).p == pytest.approx(0.1)  # the interval just touches zero
    assert p < 0.01
    assert mean_difference([1.0, 2.0])[0] == 2 and np.isnan(mean_difference([1.0, 2.0]).mean)
    assert mean_difference([0.3] * 3) == (3, 0.3, 0.3, 0.3, 0.0)
    assert mean_difference([0.0] * 3).p == 1


def test_holm():
    # 0.01 x 4, 0.02 x 3, 0.03 x 2 = 0.06 again, 0.5; in any order, and NaN is no test
    np.testing.assert_allclose(holm([0.03, np.nan, 0.01, 0.5, 0.02]), [0.06, np.nan, 0.04, 0.5, 0.06])
    np.testing.assert_allclose(holm([0.4, 0.9, 0.4]), [1, 1, 1])
    assert len(holm([])) == 0


@pytest.mark.parametrize(
    ("differences", "verdict"),
    [
        (around(0.2, 1.4), EQUIVALENT),
        (around(1.5, 0.1), EQUIVALENT),  # resolved, and inside the band
        (around(2.5, 0.5), DIFFERS),
        (around(-2.5, 0.5), DIFFERS),
        (around(1.5, 1.4), NOT_RESOLVED),  # from 0.5 to 2.5
        (around(0.0, 4.0), NOT_RESOLVED),
        ([0.1, 0.1], None),
        ([np.nan] * 7, None),
    ],
)
def test_verdicts_of_known_cases(differences, verdict):
    others = {("net", f"coordination_{k}"): around(0.0, 1.4) for k in range(9)}  # so that there are ten tests
    row = judge(errors({("net", "density_g_cm3"): differences} | others)).iloc[0]
    assert row.verdict == verdict if verdict else pd.isna(row.verdict)


def test_many_comparisons_take_more_to_differ():
    """p of 0.006 differs alone, and not among twenty; what is equivalent stays so."""
    clear = {("net", "density_g_cm3"): around(4.0, 2.6)}
    alone = judge(errors(clear))
    assert (alone.verdict[0], alone.p_holm[0]) == (DIFFERS, alone.p[0])
    among = judge(errors(clear | {("net", f"coordination_{k}"): around(0.0, 1.0) for k in range(19)}))
    assert (among.verdict[0], among.p_holm[0]) == (NOT_RESOLVED, pytest.approx(20 * among.p[0]))
    assert set(among.verdict[1:]) == {EQUIVALENT}


def test_a_surrogate_differs_or_not_whatever_others_are_judged():
    """p of 0.006 is enough among its own two measures, and would not be among all 22 of the table."""
    clear = {("net", "density_g_cm3"): around(4.0, 2.6), ("net", "overlap_mean"): around(0.0, 1.0)}
    others = {(f"other{k}", "density_g_cm3"): around(0.0, 1.0) for k in range(20)}
    table = judge(errors(clear | others))
    assert table.p_holm[0] == pytest.approx(2 * table.p[0])
    assert FAMILY_LEVEL / 22 < table.p[0] < FAMILY_LEVEL / 2
    assert list(table.verdict) == [DIFFERS] + 21 * [EQUIVALENT]


def test_a_scatter_of_zero_or_none_measures_nothing():
    rows = errors({("net", "density_g_cm3"): [1.0] * 7})
    for unknown in (0.0, np.nan):
        assert judge(rows.assign(replica_sd=unknown)).verdict.isna().all()


def test_judged_are_relaxed_structures_of_some_slurries():
    judged = ["density_g_cm3", "rdf_all", "rdf_A-B", "coordination_A-B", "share_below_4_contacts", "overlap_mean"]
    judged.append("coarseness_2um_A")
    others = ["overlap_max", "packing_nominal", "packing_union"]
    rows = errors({("net", quantity): [0.0] * 7 for quantity in judged + others})
    rows = pd.concat([rows, rows.assign(stage="predicted")])
    found = judged_rows(rows, ["2", "3"])
    assert list(dict.fromkeys(found.quantity)) == judged
    assert (set(found.stage), set(found.slurry)) == ({"relaxed"}, {"2", "3"})
    assert all(sum(quantity.startswith(start) for start in MEASURES.values()) == 1 for quantity in judged)


def test_noise_alone_is_rarely_said_to_differ():
    """Families of twelve measures, each with the noise of the DEM and of the structure; any "differs" is false."""
    rng, false, equivalent = np.random.default_rng(8), 0, []
    for _ in range(150):
        drawn = rng.normal(size=(12, 7)) - rng.normal(size=(12, 7))
        verdicts = judge(errors({("net", f"coordination_{k}"): list(row) for k, row in enumerate(drawn)})).verdict
        false += (verdicts == DIFFERS).any()
        equivalent.append((verdicts == EQUIVALENT).mean())
    assert false / 150 <= FAMILY_LEVEL
    assert np.mean(equivalent) > 0.85


def curves_of(rng: np.random.Generator, runs: int, off_sds: float = 0.0) -> np.ndarray:
    """Noise of g(r) in 40 bins of some runs (runs, 40), the same systematic difference in all."""
    return rng.normal(size=(runs, 40)) + off_sds * np.random.default_rng(1).normal(size=40)


@pytest.mark.parametrize(("off_sds", "verdict"), [(0.0, EQUIVALENT), (1.0, EQUIVALENT), (3.0, DIFFERS)])
def test_rdf_verdicts_of_noise_and_of_curves_that_are_off(off_sds, verdict):
    """The noise is that of five replicas; their mean difference is wrong by some percent, the same for all slurries."""
    rng, rows = np.random.default_rng(3), []
    for label in range(100):
        replicas = [pd.DataFrame({"r_um": range(40), "g": g}) for g in curves_of(rng, 5)]
        difference = np.abs(curves_of(rng, 7, off_sds) - curves_of(rng, 7)).mean(axis=1)
        spread = rdf_spread(replicas)[0]
        rows += [
            (str(label), slurry, "rdf_all", d, 0.0, spread) for slurry, d in zip(SLURRIES, difference, strict=True)
        ]
    columns = ["surrogate", "slurry", "quantity", "value", "dem_value", "replica_sd"]
    table = judge(pd.DataFrame(rows, columns=columns))
    assert (table.verdict == verdict).mean() > 0.98
    expected = off_sds * np.sqrt(np.mean(np.random.default_rng(1).normal(size=40) ** 2))
    assert np.median(table.mean_in_sd) == pytest.approx(expected, abs=0.4 if off_sds == 0 else 0.2)


def test_rdf_differences_are_those_of_the_curves():
    """Equal to a replica: 0. Equal to the DEM: -2, so the root of the mean is within the band. At the band: 4."""
    rows = pd.DataFrame({"quantity": "rdf_all", "value": [0.05, 0.0, 0.05 * RDF_BAND], "replica_sd": 0.05})
    np.testing.assert_allclose(in_noise(rows.assign(dem_value=0.0)), [0, -2, 4], atol=1e-12)


def test_better_and_worse_are_corrected_over_all_that_is_compared():
    clear, weak = around(-1.0, 0.3), around(0.9, 0.9)
    assert compare({"a": clear, "b": weak, "c": [-1.0, -1.1], "d": [0.0] * 4}) == {
        "a": "better",
        "b": "worse",
        "c": None,
        "d": NOT_RESOLVED,
    }
    assert 0.02 < mean_difference(weak).p < 0.05
    assert compare({"b": weak} | {k: around(0.1, 1.0) for k in range(4)})["b"] == NOT_RESOLVED
    assert compare({}) == {}


@pytest.fixture
def table(tmp_path) -> pd.DataFrame:
    """What judge_structures writes of two surrogates, one of them judged on too few slurries."""
    rows = errors(
        {
            ("net", "density_g_cm3"): around(-9.0, 0.5),
            ("net", "coordination_A-B"): around(9.0, 0.5),
            ("net", "coordination_all"): around(0.0, 1.0),
            ("net", "coarseness_2um_A"): around(1.0, 2.0),
            ("net", "overlap_max"): around(9.0, 0.5),
            ("affine", "density_g_cm3"): [0.1, 0.1],
        }
    )
    rows = pd.concat([rows, rows.assign(slurry="V1", value=99.0), rows.assign(stage="predicted", value=99.0)])
    rows.to_csv(tmp_path / "structure_errors.csv", index=False)
    options = {"structure_errors": tmp_path / "structure_errors.csv", "slurries": SLURRIES}
    return written("judge_structures", tmp_path / "verdicts.csv", **options)


def test_table_of_verdicts(table, tmp_path):
    assert list(table.columns) == list(COLUMNS)
    net = table[table.surrogate == "net"].set_index("measure")
    assert list(net.verdict) == [DIFFERS, DIFFERS, EQUIVALENT, NOT_RESOLVED]
    assert net.mean_in_sd["density_g_cm3"] == pytest.approx(-9)
    (affine,) = table[table.surrogate == "affine"].itertuples()
    assert affine.slurries == 2 and pd.isna(affine.verdict) and pd.isna(affine.mean_in_sd)
    options = {"structure_errors": tmp_path / "structure_errors.csv", "slurries": []}
    assert written("judge_structures", tmp_path / "none.csv", **options).empty
    assert run_script("plot_verdicts", verdicts=tmp_path / "none.csv", figure=tmp_path / "none.png").returncode == 0


def test_figure_marks_each_verdict(table, tmp_path, monkeypatch):
    calls = recorded_calls(monkeypatch, plot_verdicts, "draw_verdicts")
    assert run_script(plot_verdicts, verdicts=tmp_path / "verdicts.csv", figure=tmp_path / "v.png").returncode == 0
    axes = calls[0][1].axes[0]
    assert texts(axes.get_xticklabels()) == [
        "density",
        "coordination, A-B",
        "coordination, all particles",
        "coarseness, A, 2 µm",
    ]
    assert texts(axes.get_yticklabels()) == ["net", "affine"]
    assert texts(axes.texts) == ["▼", "▲", "", "?", "–", "–", "–", "–"]
    assert is_drawn(tmp_path / "v.png")
