"""Noise of the DEM and skill: closed forms."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slurrycast.evaluation.noise import (
    COLUMNS,
    Noise,
    curves_of_replicas,
    mean_and_sd,
    rdf_difference,
    rdf_spread,
    read_noise,
    replicated_slurry,
    skill,
)
from slurrycast.runtime.files import InputError

TABLE = pd.DataFrame(
    [
        ("6", 1000, "density_g_cm3", 5, 2.25, 0.004),
        ("6", 1000, "rdf_all", 5, 0.06, 0.001),
        ("6", 1000, "perturbation_floor_um2", 1, 0.003, np.nan),
        ("2", 4000, "density_g_cm3", 5, 2.26, 0.001),
        ("2", 4000, "rdf_all", 5, 0.02, 0.002),
        ("2", 4000, "perturbation_floor_um2", 1, 0.007, np.nan),
    ],
    columns=COLUMNS,
)


def curve(g: list[float], width_um: float = 0.5) -> pd.DataFrame:
    """Curve with equal bins from 0."""
    return pd.DataFrame({"r_um": width_um * (np.arange(len(g)) + 0.5), "g": g})


# Curves of two replicas each, which differ by 0.06 and 0.02 over three bins and by less over more.
CURVES = {
    (slurry, "all"): [curve([1.0] * 5), curve([1 + d] * 3 + [1.0] * 2)] for slurry, d in (("6", 0.06), ("2", 0.02))
}


@pytest.mark.parametrize(("replica", "slurry"), [("6_r1", "6"), ("V2_r12", "V2"), ("a_r1_r2", "a_r1")])
def test_replicas_have_the_name_of_their_slurry(replica, slurry):
    assert replicated_slurry(replica) == slurry


@pytest.mark.parametrize("name", ["6", "6_r", "_r1", "6_r1b", "r1"])
def test_other_slurries_are_no_replicas(name):
    with pytest.raises(InputError, match=f"slurry {name}: not a replica"):
        replicated_slurry(name)


def test_spread_of_replicas():
    mean, sd = mean_and_sd([2.0, 4, 4, 4, 5, 5, 7, 9])
    assert (mean, sd) == (5, pytest.approx(np.sqrt(32 / 7)))
    assert np.isnan(mean_and_sd([3.0])[1])


def test_rdf_spread_is_that_of_all_pairs_over_the_common_range():
    # Constant curves 0, 1 and 3 differ by 1, 3 and 2; the fourth bin of the last one has no counterpart.
    curves = [curve([0, 0, 0]), curve([1, 1, 1]), curve([3, 3, 3, 99])]
    assert rdf_spread(curves) == (2, 1)
    assert rdf_difference(curves[0], curves[2]) == 3
    assert rdf_difference(curve([0, 1, 2]), curve([1, 1, 1, 7])) == pytest.approx(2 / 3)


@pytest.mark.parametrize("other", [curve([0, 1], width_um=0.4), curve([])])
def test_bins_of_other_widths_are_refused(other):
    with pytest.raises(InputError, match="bins of different width"):
        rdf_difference(curve([0, 1]), other)


def test_spread_of_replicas_falls_with_the_square_root_of_their_number():
    rng = np.random.default_rng(2)
    sds = [np.mean([mean_and_sd(rng.normal(size=(5, n)).mean(axis=1))[1] for _ in range(2000)]) for n in (25, 100)]
    noise = Noise(Path("noise.csv"), pd.DataFrame([("a", 25, "q", 5, 0, sds[0])], columns=COLUMNS))
    assert noise.spread("q", 100) == pytest.approx(sds[1], rel=0.05)


def test_scatter_is_pooled_over_the_sizes_and_floors_are_not():
    """Variance x particles: 0.016 and 0.004 of 5 runs each, and RDF differences x sqrt(particles)."""
    noise = Noise(Path("noise.csv"), TABLE)
    rdf = (0.06 * 1000**0.5 + 0.02 * 4000**0.5) / 2
    for particles, floor_um2 in ((250, 0.003), (1960, 0.003), (2040, 0.007), (16000, 0.007)):  # 2000: the middle in log
        assert noise.spread("density_g_cm3", particles) == pytest.approx((0.01 / particles) ** 0.5)
        assert noise.rdf_spread("all", particles, CURVES, 3) == pytest.approx(rdf / particles**0.5)
        assert noise.floor_um2(particles) == floor_um2


def test_pooled_slurries_count_by_their_degrees_of_freedom():
    rows = TABLE[TABLE.quantity == "density_g_cm3"].assign(runs=[3, 9])
    one = ("3", 500, "density_g_cm3", 1, 2.25, np.nan)  # scatters with nothing
    noise = Noise(Path("noise.csv"), pd.concat([rows, pd.DataFrame([one], columns=COLUMNS)]))
    assert noise.spread("density_g_cm3", 1000) == pytest.approx(((2 * 0.016 + 8 * 0.004) / 10 / 1000) ** 0.5)
    curves = {("6", "all"): CURVES["6", "all"], ("2", "all"): [curve([0] * 3), curve([0] * 3), curve([0.3] * 3)]}
    pooled = (0.06 * 1000**0.5 + 2 * 0.2 * 4000**0.5) / 3
    assert Noise(Path("noise.csv"), TABLE).rdf_spread("all", 1, curves, 3) == pytest.approx(pooled)


def test_pooled_scatter_is_that_of_all_sizes():
    """Replicas of two sizes, drawn with variance 1 / particles: the pooled variance has no bias at any size."""
    rng = np.random.default_rng(4)
    variances = []
    for _ in range(500):
        rows = [(name, n, "q", 4, *mean_and_sd(rng.normal(size=4) / n**0.5)) for name, n in (("a", 600), ("b", 3000))]
        variances.append(Noise(Path("noise.csv"), pd.DataFrame(rows, columns=COLUMNS)).spread("q", 1200) ** 2)
    assert np.mean(variances) * 1200 == pytest.approx(1, abs=4 * np.std(variances) * 1200 / 500**0.5)
    assert np.std(variances) * 1200 == pytest.approx((2 / 6) ** 0.5, rel=0.1)  # six degrees of freedom


def test_rdf_spread_is_over_the_bins_compared():
    noise = Noise(Path("noise.csv"), TABLE)
    of_one = {("6", "all"): CURVES["6", "all"]}
    by_bins = [noise.rdf_spread("all", 1000, of_one, bins) for bins in (2, 3, 4, 5, 9)]
    assert by_bins == pytest.approx([0.06, 0.06, 0.045, 0.036, 0.036])  # the replicas end after 5
    longer = {("2", "all"): [curve([1.0] * 7), curve([1.5] * 7)]}
    assert noise.rdf_spread("all", 4000, of_one | longer, 7) == pytest.approx(0.5)  # only these have seven bins
    with pytest.raises(InputError, match="RDF NiO-NiO: no slurry with the curves of two replicas"):
        noise.rdf_spread("NiO-NiO", 1000, CURVES, 3)
    for useless in ({("6", "all"): CURVES["6", "all"][:1]}, {("other", "all"): CURVES["6", "all"]}):
        with pytest.raises(InputError, match="RDF all: no slurry with the curves of two replicas"):
            noise.rdf_spread("all", 1000, useless, 3)


def test_curves_belong_to_the_slurry_that_is_replicated():
    tables = [
        curve([k, k]).assign(slurry=f"{slurry}_r{k}", pair=pair)
        for slurry in ("6", "V_r1")
        for k in (1, 2)
        for pair in ("all", "NiO-NiO")
    ]
    curves = curves_of_replicas(pd.concat(tables))
    assert set(curves) == {(slurry, pair) for slurry in ("6", "V_r1") for pair in ("all", "NiO-NiO")}
    assert [list(c.g) for c in curves["V_r1", "all"]] == [[1, 1], [2, 2]]
    with pytest.raises(InputError, match="slurry 6: not a replica"):
        curves_of_replicas(curve([1]).assign(slurry="6", pair="all"))


def test_rdf_noise_of_a_larger_box_is_that_of_its_own_range():
    """Counts of an ideal gas: with the range of the larger box its spread is found, with their own it is not."""
    rng = np.random.default_rng(7)

    def replica(particles: int, bins: int) -> pd.DataFrame:
        shells = np.diff(np.arange(bins + 1.0) ** 3)
        return curve(rng.poisson(particles * shells) / (particles * shells))

    small, larger = ([replica(particles, bins) for _ in range(40)] for particles, bins in ((20, 24), (80, 12)))
    noise = Noise(Path("noise.csv"), pd.DataFrame([("6", 20, "rdf_all", 40, 0, 0)], columns=COLUMNS))
    measured = rdf_spread(larger)[0]
    assert noise.rdf_spread("all", 80, {("6", "all"): small}, 12) == pytest.approx(measured, rel=0.05)
    assert rdf_spread(small)[0] / 2 < 0.8 * measured


def test_a_quantity_without_noise_is_named(tmp_path):
    (tmp_path / "noise.csv").write_text(TABLE[:2].to_csv(index=False))
    noise = read_noise(tmp_path / "noise.csv")
    assert noise.spread("density_g_cm3", 1000) == pytest.approx(0.004)
    assert np.isnan(noise.spread("coarseness_4um_NiO", 1000))
    with pytest.raises(InputError, match=r"noise\.csv: no perturbation_floor_um2"):
        noise.floor_um2(1000)
    (tmp_path / "noise.csv").write_text(TABLE.drop(columns="sd").to_csv(index=False))
    with pytest.raises(InputError, match=r"noise\.csv: no column sd"):
        read_noise(tmp_path / "noise.csv")


@given(st.floats(1e-3, 10), st.floats(1e-3, 10), st.floats(1e-3, 10))
def test_skill_is_linear_between_affine_and_floor(floor_um2, to_win_um2, share):
    affine_um2 = floor_um2 + to_win_um2
    assert skill(affine_um2, affine_um2, floor_um2) == 0
    assert skill(floor_um2, affine_um2, floor_um2) == 1
    mse_um2 = floor_um2 + share * to_win_um2
    assert skill(mse_um2, affine_um2, floor_um2) == pytest.approx(1 - share, rel=1e-6, abs=1e-6)


def test_no_skill_is_defined_where_affine_is_at_the_floor():
    assert np.isnan(skill(0.1, 0.2, 0.2))
    assert np.isnan(skill(0.1, 0.2, 0.3))
