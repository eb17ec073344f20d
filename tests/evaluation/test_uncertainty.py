"""Calibration of spreads: closed forms, properties, and the scripts on small made-up predictions."""

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import norm

import plot_uncertainty
from pictures import is_drawn
from script_runs import refusal, run_script, written
from slurrycast.evaluation.uncertainty import (
    Judged,
    binned_um,
    calibrate,
    conformal_factor,
    coverage,
    expected_coverage,
    rank_correlation,
    read_calibration,
)
from slurrycast.runtime.files import InputError
from structures import frame, write_store

EDGES_UM = np.array([6.0, 6.0, 12.0])
FACTORS = {0.5: 0.6745, 0.9: 1.6449}  # quantiles of |z|, z standard normal
scores = arrays(np.float64, st.integers(20, 60), elements=st.integers(0, 10**6).map(lambda value: value / 1e5))
no_deadline = settings(deadline=None)  # times say nothing on a busy machine
several = st.lists(scores, min_size=1, max_size=4)


def standard_error(level: float, sizes: list[int]) -> float:
    """Of the quantile of |z| of slurries of equal weight: of sqrt(level (1 - level) / n) / density for one of n."""
    density = 2 * norm.pdf(norm.ppf((1 + level) / 2))
    variance = sum(level * (1 - level) / size for size in sizes) / len(sizes) ** 2
    return math.sqrt(variance) / density


def normal(slurry: str, particles: int, seed: int, honest: float = 1.0) -> Judged:
    """Normal errors whose sd is `honest` times the spread, which differs from coordinate to coordinate."""
    rng = np.random.default_rng(seed)
    spread_um = rng.uniform(0.05, 0.5, (particles, 3))
    return Judged("net", slurry, spread_um, honest * spread_um * rng.normal(size=(particles, 3)))


@pytest.mark.parametrize("sizes", [[20000], [1000, 9000], [500, 500, 8000]])
@pytest.mark.parametrize("honest", [1.0, 0.3])
def test_factors_of_normal_errors_are_normal_quantiles(sizes, honest):
    judged = [normal(str(k), particles, k, honest) for k, particles in enumerate(sizes)]
    calibration = calibrate(judged)
    assert calibration.levels == (0.5, 0.9)
    assert calibration.slurries == tuple(map(str, range(len(sizes))))
    assert calibration.coordinates == 3 * sum(sizes)
    for level, factor in zip(calibration.levels, calibration.factors, strict=True):
        error = honest * standard_error(level, [3 * particles for particles in sizes])
        assert abs(factor - honest * FACTORS[level]) < 4 * error
        assert error < 0.03  # else the line above says nothing


def test_each_slurry_has_the_same_weight():
    """Two populations of scores, 0 to 1 and 2 to 3: the median lies between them whatever their sizes are."""
    low, high = np.linspace(0, 1, 2000), np.linspace(2, 3, 50)
    assert conformal_factor([low], 0.5) == pytest.approx(0.5, abs=1e-3)
    assert conformal_factor([low, high], 0.25) == pytest.approx(0.5, abs=1e-3)
    assert conformal_factor([low, high], 0.75) == pytest.approx(2.5, abs=0.05)
    assert conformal_factor([np.concatenate([low, high])], 0.75) < 1


@pytest.mark.parametrize("n", [9, 10, 19, 99, 1000])
@pytest.mark.parametrize("level", [0.5, 0.9])
def test_of_one_slurry_it_is_the_conformal_rank(n, level):
    found = conformal_factor([np.random.default_rng(n).permutation(np.arange(1.0, n + 1))], level)
    assert found == math.ceil(round((n + 1) * level, 9))


def test_too_few_coordinates_for_a_level():
    with pytest.raises(InputError, match=r"8 coordinates: too few for a level of 0\.9"):
        conformal_factor([np.arange(8.0)], 0.9)


@no_deadline
@given(several, st.floats(0.1, 0.9))
def test_a_factor_covers_its_level_where_it_was_found_and_no_smaller_one_does(several, level):
    factor = conformal_factor(several, level)
    total = sum(map(len, several))
    shares = [np.mean([coverage(own, f) for own in several]) for f in (factor, np.nextafter(factor, -1))]
    assert shares[0] * total / (total + 1) >= level - 1e-9
    assert shares[1] * total / (total + 1) < level + 1e-9


@no_deadline
@given(several, st.floats(0.1, 0.9), st.floats(0.1, 0.9), st.sampled_from([0.25, 2.0, 8.0]))
def test_a_factor_grows_with_the_level_and_with_the_scores(several, one, other, scale):
    low, high = sorted([one, other])
    assert conformal_factor(several, low) <= conformal_factor(several, high)
    assert conformal_factor([scale * own for own in several], one) == scale * conformal_factor(several, one)


@no_deadline
@given(several, st.floats(0.1, 0.9), st.randoms())
def test_the_order_of_slurries_and_of_coordinates_does_not_matter(several, level, random):
    shuffled = [np.array(random.sample(list(own), len(own))) for own in random.sample(several, len(several))]
    # sums of the same weights in another order may round to the other side of a level that falls between two
    found = {conformal_factor(shuffled, level + step) for step in (-1e-9, 0, 1e-9)}
    assert conformal_factor(several, level) in found


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 10**6))
def test_conformal_prediction_keeps_its_promise(seed):
    """Further coordinates of the same slurry: covered in at least 90 % of many draws, and in hardly more."""
    draws = np.abs(np.random.default_rng(seed).standard_t(2, (400, 51)))
    covered = [conformal_factor([own[:-1]], 0.9) >= own[-1] for own in draws]
    # ceil(0.9 x 51) / 51 = 0.902; five standard errors of 400 draws
    assert abs(np.mean(covered) - 46 / 51) < 5 * math.sqrt(0.9 * 0.1 / 400)


def test_predictions_of_several_surrogates_are_not_calibrated_together():
    other = Judged("other", "2", np.ones((30, 3)), np.ones((30, 3)))
    with pytest.raises(InputError, match="predictions of net, other: needed are those of one"):
        calibrate([normal("1", 30, 1), other])
    with pytest.raises(InputError, match="predictions of no surrogate"):
        calibrate([])


def test_rank_correlation_of_a_spread_that_knows_all_or_nothing():
    rng = np.random.default_rng(1)
    direction = rng.normal(size=(5000, 3))
    length_um = rng.uniform(0.1, 1, (5000, 1))
    error_um = length_um * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    knows = np.broadcast_to(length_um**3, (5000, 3))
    assert rank_correlation(knows, error_um) == pytest.approx(1)
    assert rank_correlation(1 / knows, error_um) == pytest.approx(-1)
    # without any relation its standard deviation is 1 / sqrt(n - 1)
    assert abs(rank_correlation(rng.uniform(1, 2, (5000, 3)), error_um)) < 4 / math.sqrt(4999)
    assert np.isnan(rank_correlation(np.ones((5000, 3)), error_um))
    assert np.isnan(rank_correlation(knows, np.zeros((5000, 3))))


def test_rank_correlation_is_of_particles_not_of_axes():
    """The same spread over the particle, whatever axis it is on."""
    rng = np.random.default_rng(2)
    spread_um = rng.uniform(0.1, 1, (50, 3))
    turned = np.array([rng.permutation(row) for row in spread_um])
    error_um = rng.normal(size=(50, 3))
    assert rank_correlation(turned, error_um) == pytest.approx(rank_correlation(spread_um, error_um), abs=0.01)


def test_coverage_counts_what_is_at_the_edge():
    assert coverage(np.array([0.5, 1.0, 1.5, 2.0]), 1.0) == 0.5


def test_honest_spreads_lie_on_both_diagonals():
    one, levels = normal("1", 20000, 7), np.array([0.1, 0.5, 0.9, 0.99])
    found = expected_coverage(one.scores, levels)
    assert (np.abs(found - levels) < 4 * np.sqrt(levels * (1 - levels) / 60000)).all()
    assert (expected_coverage(normal("1", 20000, 7, honest=2).scores, levels) < levels - 0.01).all()
    spread_um, error_um = binned_um(one.spread_um, one.error_um, 10)
    # the standard error of an rms of n normal errors is its share 1 / sqrt(2 n)
    np.testing.assert_allclose(error_um / spread_um, 1, atol=5 / math.sqrt(2 * 6000))
    assert (np.diff(spread_um) > 0).all()


@no_deadline
@given(arrays(np.float64, (7, 3), elements=st.floats(0.1, 1)), st.integers(1, 40))
def test_bins_hold_equally_many_coordinates(spread_um, bins):
    first, second = binned_um(spread_um, spread_um, bins)
    assert len(first) == min(bins, 21)
    np.testing.assert_array_equal(first, second)
    sizes = [len(part) for part in np.array_split(np.arange(21), len(first))]
    assert max(sizes) - min(sizes) <= 1
    assert np.average(first**2, weights=sizes) == pytest.approx(np.mean(spread_um**2))


# ---- files


def write_pair(folder: Path, slurry: str, particles: int = 200, spread=0.1, shift_um: float = 0.0) -> tuple[Path, Path]:
    """A prediction whose errors are normal with sd 0.2 um, with a common shift on top, and the DEM; frame 120."""
    rng = np.random.default_rng(int(slurry.strip("V")))
    target_um = rng.uniform(-0.5, 0.5, (particles, 3)) * EDGES_UM
    error_um = rng.normal(0, 0.2, (particles, 3))
    predicted_um = target_um + error_um - error_um.mean(axis=0) + shift_um
    spread_um = None if spread is None else np.broadcast_to(spread, (particles, 3)).astype(float)
    paths = folder / f"net_{slurry}.h5", folder / f"dem_{slurry}.h5"
    write_store(paths[0], [frame(120, predicted_um, EDGES_UM, spread_um)], slurry=slurry, surrogate="net")
    write_store(paths[1], [frame(120, target_um, EDGES_UM)], slurry=slurry)
    return paths


@pytest.fixture
def calibrated(tmp_path):
    """Calibrate on pairs of files; returns the finished run and the path of the calibration."""

    def start(*pairs):
        predicted, frames = zip(*pairs, strict=True)
        path = tmp_path / "calibration.json"
        options = {"predicted": predicted, "frames": frames, "target_frame": 120}
        return run_script("calibrate_spread", **options, calibration=path), path

    return start


def test_calibration_from_files(calibrated, tmp_path):
    """Spreads half as large as the errors, and a shift of everything, which is no error."""
    done, path = calibrated(write_pair(tmp_path, "V1", 3000), write_pair(tmp_path, "V2", 900, shift_um=5.0))
    assert done.returncode == 0, done.stderr
    content = json.loads(path.read_text())
    assert set(content) == set(KEYS)
    assert (content["surrogate"], content["slurries"], content["coordinates"]) == ("net", ["V1", "V2"], 11700)
    for level, factor in zip(content["levels"], content["factors"], strict=True):
        assert abs(factor - 2 * FACTORS[level]) < 4 * 2 * standard_error(level, [9000, 2700])
    assert read_calibration(path).factors == tuple(content["factors"])
    assert done.stdout.startswith("[net] 50% within 1.3")


@pytest.mark.parametrize(
    ("spread", "says"),
    [
        (None, "has no spread, surrogate net did not give one"),
        (0.0, "has spreads that are not finite and above 0"),
        (np.nan, "has spreads that are not finite and above 0"),
    ],
)
def test_predictions_without_a_sound_spread_are_refused(calibrated, tmp_path, spread, says):
    pair = write_pair(tmp_path, "V1", spread=spread)
    done, path = calibrated(pair)
    assert done.returncode == 1
    assert done.stderr == f"error: {pair[0]}: {says}\n"
    assert not path.exists()


def test_pairs_of_other_slurries_are_refused(calibrated, tmp_path):
    one, other = write_pair(tmp_path, "V1"), write_pair(tmp_path, "V2")
    done, _ = calibrated((one[0], other[1]))
    assert done.returncode == 1
    assert done.stderr == f"error: {one[0]}: slurry V1, not the particles of {other[1]}\n"


KEYS = ("surrogate", "levels", "factors", "slurries", "coordinates")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"levels": [0.5]}, ""),
        ({"levels": [0.5, 1.5]}, ""),
        ({"levels": [], "factors": []}, ""),
        *(({"factors": value}, "") for value in ([1.0, float("nan")], [1.0, -1.0], "ab", None)),
        ({"slurries": 3}, ""),
        ({"coordinates": "many"}, ""),
        *(({name: ...}, rf"not a calibration \(KeyError: '{name}'\)") for name in KEYS),  # ... is taken out
    ],
)
def test_something_else_is_no_calibration(tmp_path, change, said):
    sound = calibrate([normal("1", 100, 1)])
    sound.write(tmp_path / "c.json")
    assert read_calibration(tmp_path / "c.json") == sound
    content = json.loads((tmp_path / "c.json").read_text()) | change
    content = {name: value for name, value in content.items() if value is not ...}
    (tmp_path / "c.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match=rf"c\.json: {said}") as error:
        read_calibration(tmp_path / "c.json")
    assert "\n" not in str(error.value)


@pytest.fixture
def measured(calibrated, tmp_path):
    """Two slurries judged by the calibration of the first; returns options of the script and its outputs."""
    validation = write_pair(tmp_path, "V1", 2000)
    test = write_pair(tmp_path, "2", 1000, spread=np.array([0.2, 0.1, 0.1]))
    calibrated(validation)
    predicted, frames = zip(validation, test, strict=True)
    options = {"predicted": predicted, "frames": frames, "target_frame": 120}
    options |= {"calibrations": tmp_path / "calibration.json", "roles": json.dumps({"V1": "validation", "2": "test"})}
    return options | {"table": tmp_path / "uncertainty.csv"}


def test_uncertainty_from_files(measured, tmp_path):
    table = written("measure_uncertainty", **measured)
    columns = ["surrogate", "slurry", "role", "level", "factor", "coverage"]
    assert list(table.columns) == [*columns, "rank_correlation", "mean_spread_um", "rms_error_um"]
    of_rows = [("V1", "validation", 0.5), ("V1", "validation", 0.9), ("2", "test", 0.5), ("2", "test", 0.9)]
    assert list(zip(table.slurry, table.role, table.level, strict=True)) == of_rows
    factors = read_calibration(tmp_path / "calibration.json").factors
    np.testing.assert_allclose(table.factor, [*factors, *factors])
    # of those it was found on, the conformal rank out of 6000
    np.testing.assert_allclose(table.coverage[:2], [3001 / 6000, 5401 / 6000], rtol=1e-8)
    # one axis of three has twice the spread, which makes it honest: its intervals are twice as wide as they should be
    for level, found in zip((0.5, 0.9), table.coverage[2:], strict=True):
        wide = 2 * norm.cdf(2 * FACTORS[level]) - 1
        expected = (wide + 2 * level) / 3
        noise = math.sqrt(expected * (1 - expected) / 3000 + level * (1 - level) / 6000)
        assert abs(found - expected) < 5 * noise
    np.testing.assert_allclose(table.mean_spread_um, [0.1, 0.1, 0.4 / 3, 0.4 / 3])
    np.testing.assert_allclose(table.rms_error_um, 0.2, rtol=5 / math.sqrt(2 * 3000))
    assert table.rank_correlation.isna().all()  # all particles of a slurry have the same spread


def test_what_does_not_belong_to_the_predictions_is_refused(measured, tmp_path):
    other = tmp_path / "other.json"
    calibrate([Judged("other", "V1", np.ones((30, 3)), np.ones((30, 3)))]).write(other)
    for option, value, says in (
        ("roles", '{"V1": "validation"}', "slurry 2 has none"),
        ("calibrations", other, "none of surrogate net"),
    ):
        assert refusal("measure_uncertainty", **measured | {option: value}) == f"error: --{option}: {says}\n"


@pytest.mark.parametrize("script", ["calibrate_spread", "measure_uncertainty", "plot_uncertainty"])
def test_one_dem_for_each_prediction(measured, tmp_path, script):
    own = {
        "calibrate_spread": {"calibration": tmp_path / "c.json"},
        "measure_uncertainty": {name: measured[name] for name in ("calibrations", "roles", "table")},
        "plot_uncertainty": {"uncertainty": tmp_path / "calibration.json", "figure": tmp_path / "f.png"},
    }[script]
    pairs = {"predicted": measured["predicted"], "frames": measured["frames"][:1], "target_frame": 120}
    done = run_script(script, **pairs, **own)
    assert (done.returncode, done.stderr) == (2, "error: 2 --predicted but 1 --frames: one each is needed\n")


def test_figure_from_files(measured, tmp_path):
    written("measure_uncertainty", **measured)
    pairs = {name: measured[name] for name in ("predicted", "frames", "target_frame")}
    figure = tmp_path / "uncertainty.png"
    done = run_script("plot_uncertainty", **pairs, uncertainty=measured["table"], figure=figure)
    assert done.returncode == 0, done.stderr
    assert is_drawn(figure)


@no_deadline
@given(st.lists(st.floats(0, 1), min_size=1, max_size=9).map(sorted), st.floats(0.01, 0.3))
def test_names_keep_their_distance_and_their_centre(places, least):
    found = plot_uncertainty.spaced(places, least)
    assert (np.diff(found) >= least - 1e-9).all()
    if (np.diff(places) >= least).all():
        np.testing.assert_allclose(found, places, atol=1e-12)
    np.testing.assert_allclose(plot_uncertainty.spaced([0.5, 0.5], least), [0.5 - least / 2, 0.5 + least / 2])


def test_figure_shows_the_numbers():
    judged = [normal("V1", 3000, 1), normal("2", 3000, 2, honest=2.0)]
    rows = [("net", "V1", "validation", 0.9, 0.9), ("net", "2", "test", 0.9, 0.59)]
    table = pd.DataFrame(rows, columns=["surrogate", "slurry", "role", "level", "coverage"])
    reliability, sharpness = plot_uncertainty.draw_uncertainty(judged, table).axes
    honest, doubtful = (line.get_ydata() for line in reliability.lines if len(line.get_ydata()) > 10)
    levels = plot_uncertainty.CURVE_LEVELS
    np.testing.assert_allclose(honest, 100 * expected_coverage(judged[0].scores, levels))
    assert (doubtful < honest).all()
    dots = [tuple(line.get_xydata()[0]) for line in reliability.lines if len(line.get_xdata()) == 1]
    assert sorted(dots) == [(90, 59), (90, 90)]
    curves = [line for line in sharpness.lines if len(line.get_xdata()) == plot_uncertainty.BINS]
    for line, one in zip(curves, judged, strict=True):
        np.testing.assert_allclose(line.get_xydata().T, binned_um(one.spread_um, one.error_um, plot_uncertainty.BINS))
