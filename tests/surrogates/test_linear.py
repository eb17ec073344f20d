"""Least squares on the input frames: exact where the truth is linear, and at the minimum where it is not."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize

from slurrycast.data.dataset import TrainingSet, read_training_set, write_training_set
from slurrycast.runtime.files import InputError
from slurrycast.surrogates.linear import Linear, combined
from slurrycast.surrogates.prediction import PredictionInput
from structures import frame, particles, training_set

N = 60
COEFFICIENTS = np.array([0.5, -0.25, -1.0, 1.5])


def prediction_input(places_um: np.ndarray, numbers=(7, 8, 9, 10)) -> PredictionInput:
    """Of coordinates (n, frames, 3)."""
    frames = tuple(frame(k, places_um[:, column], np.full(3, 2.0)) for column, k in enumerate(numbers))
    return PredictionInput("A", particles(np.ones(len(places_um), dtype=int)), frames)


@pytest.fixture
def data() -> TrainingSet:
    """Targets that are a linear combination of the coordinates; other features that say nothing."""
    features = np.random.default_rng(2).normal(0, 10, (N, 4, 6))
    targets = np.einsum("nfa,f->na", features[..., 2:5], COEFFICIENTS)
    edges_um = np.full((1, 4, 3), 20.0)
    return training_set(features, targets, edges_um, edges_um[:, -1], share=0.25)


def test_exact_coefficients_are_recovered(data, tmp_path):
    model = Linear().fit(data, {"seed": 1}, tmp_path / "model.json")
    np.testing.assert_allclose(model["coefficients"], COEFFICIENTS, atol=1e-12)
    assert max(model["training_mse_um2"], model["validation_mse_um2"]) < 1e-20
    off_um = data.features[:, -1, 2:5] - data.targets  # the box does not change
    for part, samples in (("training", ~data.is_validation), ("validation", data.is_validation)):
        assert model[f"affine_{part}_mse_um2"] == pytest.approx(np.mean(off_um[samples] ** 2))
        assert model[f"affine_{part}_mae_um"] == pytest.approx(np.mean(np.abs(off_um[samples])))
    other = np.random.default_rng(3).normal(0, 30, (9, 4, 3))
    predicted = Linear().predict(prediction_input(other), tmp_path / "model.json", {})
    np.testing.assert_allclose(predicted.position_um, np.einsum("nfa,f->na", other, COEFFICIENTS), atol=1e-9)
    assert predicted.edges_um is None


def test_the_fit_is_the_minimum_of_the_training_error_alone(data, tmp_path):
    noisy = replace(data, targets=data.targets + np.random.default_rng(4).normal(0, 3, (N, 3)))
    model = Linear().fit(noisy, {}, tmp_path / "model.json")

    def mse_um2(coefficients, part):
        places_um, targets = noisy.features[part][..., 2:5], noisy.targets[part]
        return np.mean((np.einsum("nfa,f->na", places_um, coefficients) - targets) ** 2)

    trained, held = ~noisy.is_validation, noisy.is_validation
    found = scipy.optimize.minimize(mse_um2, np.zeros(4), args=(trained,), tol=1e-12)
    np.testing.assert_allclose(model["coefficients"], found.x, atol=1e-5)
    assert model["training_mse_um2"] == pytest.approx(found.fun, rel=1e-9)
    assert model["validation_mse_um2"] == pytest.approx(mse_um2(model["coefficients"], held), rel=1e-12)
    spoilt = replace(noisy, targets=np.where(held[:, None], 1e6, noisy.targets))
    assert Linear().fit(spoilt, {}, tmp_path / "spoilt.json")["coefficients"] == model["coefficients"]


def test_axes_share_their_coefficients_and_prediction_grows_with_the_coordinates(data, tmp_path):
    noisy = replace(data, targets=data.targets + np.random.default_rng(4).normal(0, 3, (N, 3)))
    Linear().fit(noisy, {}, tmp_path / "model.json")
    places_um = np.random.default_rng(5).normal(0, 10, (8, 4, 3))
    predicted = Linear().predict(prediction_input(places_um), tmp_path / "model.json", {}).position_um
    turned = (
        Linear().predict(prediction_input(2.5 * places_um[..., [2, 0, 1]]), tmp_path / "model.json", {}).position_um
    )
    np.testing.assert_allclose(turned, 2.5 * predicted[:, [2, 0, 1]], rtol=1e-12)


def test_models_that_do_not_fit_are_refused(data, tmp_path):
    path = tmp_path / "model.json"
    places_um = np.ones((2, 4, 3))
    for _ in range(2):
        with pytest.raises(InputError, match=r"model\.json: not a readable linear model"):
            Linear().predict(prediction_input(places_um), path, {})
        path.write_text('{"input_frames": [7, 8, 9, 10]}')
    Linear().fit(data, {}, path)
    with pytest.raises(InputError, match=r"coefficients have shape \(4,\), expected \(3,\)"):
        combined(path, prediction_input(places_um).frames, places_um.swapaxes(1, 2)[..., :3])
    with pytest.raises(InputError, match=r"was fitted to input frames \[7, 8, 9, 10\], asked with \[6, 7, 8, 9\]"):
        Linear().predict(prediction_input(places_um, (6, 7, 8, 9)), path, {})


def test_the_script_fits_without_keras(data, tmp_path, run_main, capsys):
    write_training_set(tmp_path / "training.h5", data, seed=1)
    paths = {"dataset": tmp_path / "training.h5", "model": tmp_path / "model.json", "cost": tmp_path / "cost.json"}
    run_main("fit_surrogate", surrogate="linear", settings="{}", seed=1, **paths)
    expected = Linear().fit(read_training_set(tmp_path / "training.h5"), {}, tmp_path / "again.json")
    written = json.loads((tmp_path / "model.json").read_text())
    assert written == json.loads((tmp_path / "again.json").read_text())
    assert written["coefficients"] == expected["coefficients"]
    cost = json.loads((tmp_path / "cost.json").read_text())
    assert (cost["stage"], cost["surrogate"], cost["particles"]) == ("fit_surrogate", "linear", N)
    assert "validation_mse_um2" in capsys.readouterr().out
