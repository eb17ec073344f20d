"""The network in scaled coordinates: its maps to and from the target, and what the published size changes of it."""

import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slurrycast.data.dataset import TrainingSet
from slurrycast.surrogates import vgg16, vgg16_box
from slurrycast.surrogates.affine import Affine
from slurrycast.surrogates.prediction import PredictionInput
from slurrycast.surrogates.vgg16_box import Vgg16Box
from structures import frame, particles, training_set

N = 90
CHANGES = [None, "absolute", "xu", "nobox"]
SETTINGS = {"epochs": 2, "batch_size": 16, "learning_rate": 1e-3, "threads": 1, "seed": 11}


def shrinking_slurries(scale: float = 1.0) -> TrainingSet:
    """Two slurries in shrinking boxes, all lengths but the radii `scale` times as large."""
    rng = np.random.default_rng(6)
    index = np.repeat([0, 1], N // 2)
    input_edges_um = np.array([[9.0, 9, 18], [14, 14, 16.8]])[:, None] * np.linspace(1, 0.94, 4)[:, None]
    target_edges_um = 0.7 * input_edges_um[:, 0]
    scaled = rng.uniform(-0.7, 0.7, (N, 1, 3)) + rng.normal(0, 0.01, (N, 4, 3)).cumsum(axis=1)
    static = np.column_stack([rng.integers(1, 4, N), rng.uniform(0.25, 0.55, N)])
    history = np.concatenate(
        [
            np.repeat(static[:, None], 4, axis=1),
            scale * scaled * input_edges_um[index],
            rng.integers(0, 9, (N, 4, 1)),
        ],
        axis=2,
    )
    targets = (scaled[:, -1] + rng.normal(0, 0.02, (N, 3))) * target_edges_um[index]
    return training_set(history, scale * targets, scale * input_edges_um, scale * target_edges_um)


def prediction_input(data: TrainingSet, slurry: int, final_edges_um: np.ndarray | None = None) -> PredictionInput:
    """One slurry of a training set as an input, in its true final box unless another is given."""
    history = data.features[data.slurry_index == slurry]
    some = particles(history[:, 0, 0].astype(int), history[:, 0, 1], ("A", "B", "C"))
    frames = (
        replace(frame(k, seen[:, 2:5], edges_um), coordination=seen[:, 5])
        for k, seen, edges_um in zip(
            data.input_frames, history.swapaxes(0, 1), data.input_edges_um[slurry], strict=True
        )
    )
    final_edges_um = data.target_edges_um[slurry] if final_edges_um is None else final_edges_um
    return PredictionInput(data.slurries[slurry], some, tuple(frames), final_edges_um)


@pytest.fixture
def answers(monkeypatch):
    """Let the network answer what is given, and keep what it was fed."""

    def put(output: np.ndarray) -> list[np.ndarray]:
        fed = []
        monkeypatch.setattr(vgg16, "apply_model", lambda path, features: fed.append(features) or output)
        return fed

    return put


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("slurry", [0, 1])
def test_the_right_answer_is_the_target_and_the_food_that_of_training(answers, change, slurry):
    """The maps to and from the target are inverse, and a network is asked with what it was trained with."""
    data = shrinking_slurries()
    settings = {"change": change}
    samples = vgg16_box.samples(data, change)
    selected = data.slurry_index == slurry
    fed = answers(samples.targets[selected])
    predicted = Vgg16Box().predict(prediction_input(data, slurry), "model.keras", settings)
    np.testing.assert_allclose(predicted.position_um, data.targets[selected], rtol=0, atol=1e-12)
    np.testing.assert_allclose(fed[0], samples.features[selected], rtol=1e-14)
    assert predicted.edges_um is None
    assert fed[0].shape[1:] == Vgg16Box().input_shapes(fed[0].shape[1], settings)["features"]


@pytest.mark.parametrize("change", [None, "xu", "nobox"])
def test_no_displacement_is_the_affine_prediction_in_the_box_of_the_input(answers, change):
    data = shrinking_slurries()
    asked = prediction_input(data, 1, np.array([7.0, 8.0, 11.0]))
    answers(np.zeros((N // 2, 3)))
    predicted = Vgg16Box().predict(asked, "model.keras", {"change": change})
    np.testing.assert_allclose(predicted.position_um, Affine().predict(asked, None, {}).position_um, atol=1e-12)


def test_an_absolute_answer_is_in_edges_of_the_box_of_the_input(answers):
    answers(np.full((N // 2, 3), 0.25))
    asked = prediction_input(shrinking_slurries(), 0, np.array([4.0, 8.0, 12.0]))
    predicted = Vgg16Box().predict(asked, "model.keras", {"change": "absolute"})
    np.testing.assert_allclose(predicted.position_um, np.tile([1.0, 2.0, 3.0], (N // 2, 1)))


@given(scale=st.floats(0.1, 10))
def test_scaled_coordinates_know_no_size_of_the_box(scale):
    small, large = shrinking_slurries(), shrinking_slurries(scale)
    seen = [vgg16_box.samples(data, "nobox") for data in (small, large)]
    np.testing.assert_allclose(seen[1].features, seen[0].features, rtol=1e-10)
    full = [vgg16_box.samples(data) for data in (small, large)]
    np.testing.assert_allclose(full[1].features[..., :6], full[0].features[..., :6], rtol=1e-10)
    np.testing.assert_allclose(full[1].features[..., 6:], scale * full[0].features[..., 6:], rtol=1e-10)
    np.testing.assert_allclose(full[1].targets, scale * full[0].targets, rtol=1e-9, atol=1e-11)
    absolute = [vgg16_box.samples(data, "absolute") for data in (small, large)]
    np.testing.assert_allclose(absolute[1].targets, absolute[0].targets, rtol=1e-10)


def test_each_variant_makes_one_change():
    data = shrinking_slurries()
    full, absolute, xu, nobox = (vgg16_box.samples(data, change) for change in CHANGES)
    np.testing.assert_array_equal(full.features[..., 6:], data.input_edges_um[data.slurry_index])
    np.testing.assert_array_equal(full.features[..., [0, 1, 5]], data.features[..., [0, 1, 5]])
    np.testing.assert_array_equal(absolute.features, full.features)
    np.testing.assert_array_equal(nobox.features, full.features[..., :6])
    np.testing.assert_array_equal(xu.features[..., :6], data.features)
    np.testing.assert_array_equal(xu.features[..., 6:], full.features[..., 6:])
    for variant in (xu, nobox):
        np.testing.assert_array_equal(variant.targets, full.targets)
    # one displacement in two ways: x_final less the affine prediction, and in final box edges
    edges_um = data.target_edges_um[data.slurry_index]
    last = data.features[:, -1, 2:5] / data.input_edges_um[data.slurry_index, -1]
    np.testing.assert_allclose(full.targets, (absolute.targets - last) * edges_um, atol=1e-12)
    np.testing.assert_allclose(absolute.targets * absolute.unit_um, data.targets, rtol=1e-14)


def test_layers_are_those_of_vgg16():
    data = shrinking_slurries()
    samples = vgg16_box.samples(data)
    box = vgg16.build(4, 9, vgg16.Standardisation.fitted(samples))
    published = vgg16.build(4, 6)
    # three more features for the 3 taps of 64 filters
    assert box.count_params() == published.count_params() + 3 * 3 * 64
    layers = [[layer.output.shape for layer in model.layers if layer.weights] for model in (box, published)]
    assert layers[0] == layers[1]


def fit(folder, change, **changes):
    Vgg16Box().train(shrinking_slurries(), SETTINGS | {"change": change} | changes, folder)
    return folder / "model.keras", np.loadtxt(folder / "history.csv", delimiter=",", skiprows=1)


@pytest.mark.parametrize("change", CHANGES)
def test_the_written_model_predicts_with_the_errors_of_its_history(small, tmp_path, change):
    """In um2 in the true final box; and the file is plain Keras, which safe mode loads."""
    data = shrinking_slurries()
    model, rows = fit(tmp_path, change)
    predicted = [Vgg16Box().predict(prediction_input(data, k), model, {"change": change}).position_um for k in (0, 1)]
    error_um = (np.concatenate(predicted) - data.targets)[data.is_validation]
    np.testing.assert_allclose(rows[:, 3].min(), np.mean(error_um**2), rtol=1e-3)
    with zipfile.ZipFile(model) as archive:
        layers = json.loads(archive.read("config.json"))["config"]["layers"]
    assert {layer["module"] for layer in layers} == {"keras.layers"}
    assert all(layer["registered_name"] is None for layer in layers)


def test_it_learns_a_drift_that_the_affine_prediction_lacks(small, tmp_path, monkeypatch):
    """Every particle moves on by three times its last step in the box."""
    data = shrinking_slurries()
    edges_um = data.input_edges_um[data.slurry_index]
    scaled = data.features[..., 2:5] / edges_um
    drift = (4 * scaled[:, -1] - 3 * scaled[:, -2]) * data.target_edges_um[data.slurry_index]
    learnable = replace(data, targets=drift)
    affine_loss = np.mean(vgg16_box.samples(learnable).targets ** 2)
    monkeypatch.setitem(globals(), "shrinking_slurries", lambda: learnable)
    monkeypatch.setattr(vgg16, "BLOCKS", vgg16.BLOCKS[:2] + vgg16.BLOCKS[-1:])  # learns it in fewer epochs
    _, rows = fit(tmp_path, None, epochs=60, learning_rate=3e-3)
    assert rows[-1, 1] < 0.2 * affine_loss
