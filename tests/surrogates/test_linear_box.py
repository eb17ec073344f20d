"""Least squares about the affine map: exact where the truth is linear, least elsewhere, and blind to drift."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize

from slurrycast.data.dataset import TrainingSet
from slurrycast.runtime.files import InputError
from slurrycast.surrogates.affine import Affine
from slurrycast.surrogates.linear_box import LinearBox
from slurrycast.surrogates.prediction import PredictionInput
from structures import frame, particles, training_set

N = 80
COEFFICIENT = -3.25
EDGES_UM = np.array([[9.0, 9, 18], [14, 14, 16.8]])[:, None] * np.linspace(1, 0.94, 4)[:, None]  # two slurries
FINAL_EDGES_UM = 0.7 * EDGES_UM[:, 0]


def shrinking_slurries(seed: int, drift: float = 0.0, noise_um: float = 0.0) -> TrainingSet:
    """Two slurries whose particles go back along their last step, while they drift by as many box edges a frame."""
    rng = np.random.default_rng(seed)
    index = np.repeat([0, 1], N // 2)
    steps = rng.normal(0, 0.01, (2, N // 2, 3, 3))  # slurries, particles, frames, axes
    steps -= steps.mean(axis=1, keepdims=True)
    start = rng.uniform(-0.7, 0.7, (N, 1, 3))
    drifts = drift * np.array([[[1.0, 2, -3]], [[-2, 0, 1]]])[index]
    steps = steps.reshape(N, 3, 3)
    scaled = start + np.concatenate([np.zeros_like(start), (steps + drifts).cumsum(axis=1)], axis=1)
    targets = (scaled[:, -1] + COEFFICIENT * steps[:, -1] + 110 * drifts[:, 0]) * FINAL_EDGES_UM[index]
    history = np.concatenate([np.ones((N, 4, 2)), scaled * EDGES_UM[index], np.zeros((N, 4, 1))], axis=2)
    data = training_set(history, targets + rng.normal(0, noise_um, (N, 3)), EDGES_UM, FINAL_EDGES_UM)
    # each slurry has all its particles among the training samples but every fifth
    return replace(data, is_validation=np.arange(N) % 5 == 0)


def prediction_input(data: TrainingSet, slurry: int, final_edges_um: np.ndarray) -> PredictionInput:
    """One slurry of a training set, with this final box."""
    places_um = data.features[data.slurry_index == slurry, :, 2:5].swapaxes(0, 1)
    frames = map(frame, data.input_frames, places_um, data.input_edges_um[slurry])
    return PredictionInput("A", particles(np.ones(places_um.shape[1], dtype=int)), tuple(frames), final_edges_um)


def displacement(data: TrainingSet, slurry: int, path, final_edges_um: np.ndarray) -> np.ndarray:
    """What the model predicts beyond the affine map, in final edges."""
    asked = prediction_input(data, slurry, final_edges_um)
    predicted = LinearBox().predict(asked, path, {})
    assert predicted.edges_um is None
    return (predicted.position_um - Affine().predict(asked, None, {}).position_um) / final_edges_um


@pytest.mark.parametrize("drift", [0.0, 0.05])
def test_the_coefficient_is_recovered_whatever_the_drift_of_all_particles(tmp_path, drift):
    path = tmp_path / "model.json"
    model = LinearBox().fit(shrinking_slurries(1, drift), {}, path)
    np.testing.assert_allclose(model["coefficients"], [COEFFICIENT], rtol=1e-9)
    assert model["training_mse_um2"] < 1e-20
    at_rest, drifting = (shrinking_slurries(2, value) for value in (0.0, drift))
    for slurry in (0, 1):
        seen = at_rest.features[at_rest.slurry_index == slurry, :, 2:5] / at_rest.input_edges_um[slurry]
        found = displacement(drifting, slurry, path, np.array([5.0, 6.0, 7.0]))
        np.testing.assert_allclose(found, COEFFICIENT * (seen[:, -1] - seen[:, -2]), atol=1e-9)


def test_the_fit_is_the_minimum_of_the_training_error_in_um(tmp_path):
    """The error is that of coordinates in the true final boxes, without a common shift of those of a slurry."""
    noisy = shrinking_slurries(3, noise_um=0.3)
    model = LinearBox().fit(noisy, {}, tmp_path / "model.json")
    scaled = noisy.features[..., 2:5] / noisy.input_edges_um[noisy.slurry_index]

    def mse_um2(coefficient, held):
        moved = scaled[:, -1] + coefficient * (scaled[:, -1] - scaled[:, -2])
        errors_um = noisy.targets - moved * noisy.target_edges_um[noisy.slurry_index]
        parts = [errors_um[(noisy.slurry_index == slurry) & (noisy.is_validation == held)] for slurry in (0, 1)]
        return np.mean(np.concatenate([part - part.mean(axis=0) for part in parts]) ** 2)

    found = scipy.optimize.minimize_scalar(mse_um2, args=(False,), tol=1e-12)
    np.testing.assert_allclose(model["coefficients"], [found.x], rtol=1e-5)
    assert model["training_mse_um2"] == pytest.approx(found.fun, rel=1e-9)
    assert model["validation_mse_um2"] == pytest.approx(mse_um2(model["coefficients"], True), rel=1e-9)
    spoilt = replace(noisy, targets=np.where(noisy.is_validation[:, None], 1e6, noisy.targets))
    assert LinearBox().fit(spoilt, {}, tmp_path / "spoilt.json")["coefficients"] == model["coefficients"]


def test_a_model_of_other_input_frames_or_of_linear_is_refused(tmp_path):
    data, path = shrinking_slurries(4), tmp_path / "model.json"
    LinearBox().fit(replace(data, input_frames=(6, 7, 8, 9)), {}, path)
    with pytest.raises(InputError, match=r"was fitted to input frames \[6, 7, 8, 9\], asked with \[7, 8, 9, 10\]"):
        displacement(data, 0, path, FINAL_EDGES_UM[0])
    path.write_text(json.dumps({"input_frames": [7, 8, 9, 10], "coefficients": [1.0, 2.0, 3.0, 4.0]}))
    with pytest.raises(InputError, match=r"coefficients have shape \(4,\), expected \(1,\)"):
        displacement(data, 0, path, FINAL_EDGES_UM[0])
