"""Trainings that go on with a stored model: from its weights, whatever the slurries, and the same after a kill."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from slurrycast.data.dataset import TrainingSet
from slurrycast.runtime.files import InputError
from slurrycast.surrogates import vgg16
from slurrycast.surrogates.labels import parse
from slurrycast.surrogates.samples import Standardisation
from slurrycast.surrogates.stored_model import stored_layers
from structures import training_set

SETTINGS = {"epochs": 3, "batch_size": 16, "learning_rate": 1e-3, "threads": 1, "seed": 11}
AT_REST = {"epochs": 1, "learning_rate": 1e-12}  # with which the weights stay what they were


def slurry(seed: int, scale: float = 1.0, n_frames: int = 4) -> TrainingSet:
    rng = np.random.default_rng(seed)
    edges_um = scale * 20 * np.linspace(1, 0.95, n_frames)[:, None] * np.ones(3)
    features = np.concatenate([rng.uniform(0, 3, (80, n_frames, 2)), rng.uniform(-9, 9, (80, n_frames, 4))], axis=2)
    targets = scale * (0.7 * features[:, -1, 2:5] + rng.normal(0, 0.5, (80, 3)))
    return training_set(features, targets, edges_um[None], 0.7 * edges_um[None, -1])


@pytest.fixture
def trained(small, tmp_path) -> Callable[..., Path]:
    """Train a surrogate on a slurry; the folder with its model and learning curves."""

    def train(label: str, name: str, data: TrainingSet, **settings: object) -> Path:
        folder = tmp_path / name
        folder.mkdir(exist_ok=True)
        parse(label).surrogate.train(data, {**SETTINGS, **parse(label).settings, **settings}, folder)
        return folder

    return train


def answers(folder: Path, width: int) -> np.ndarray:
    return vgg16.apply_model(folder / "model.keras", np.random.default_rng(3).uniform(-5, 5, (40, 4, width)))


@pytest.mark.parametrize("label", ["vgg16", "vgg16_box"])
def test_it_begins_where_the_stored_model_ended(trained, label):
    """With its standardisation too, though the new slurry is three times as wide."""
    width = parse(label).surrogate.input_shapes(4, parse(label).settings)["features"][1]
    first = trained(label, "first", slurry(1))
    path = str(first / "model.keras")
    second = trained(label, "second", slurry(2, 3.0), start_from=path, **AT_REST)
    np.testing.assert_allclose(answers(second, width), answers(first, width), rtol=1e-4, atol=1e-4)
    moved = answers(trained(label, "third", slurry(2, 3.0), start_from=path), width)
    assert np.abs(moved - answers(first, width)).max() > 1e-2


def test_a_killed_one_ends_like_an_undisturbed_one(trained, monkeypatch, capsys):
    path = str(trained("vgg16_box", "first", slurry(1)) / "model.keras")
    undisturbed = trained("vgg16_box", "undisturbed", slurry(2), start_from=path)
    train_epoch, epochs = vgg16.Trainer.train_epoch, iter(range(1, 9))

    def dies(*args):
        if next(epochs) == 3:
            raise KeyboardInterrupt
        return train_epoch(*args)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(vgg16.Trainer, "train_epoch", dies)
        trained("vgg16_box", "killed", slurry(2), start_from=path)
    resumed = trained("vgg16_box", "killed", slurry(2), start_from=path)
    assert "resuming after epoch 2" in capsys.readouterr().out
    assert (resumed / "history.csv").read_text() == (undisturbed / "history.csv").read_text()
    np.testing.assert_array_equal(answers(resumed, 9), answers(undisturbed, 9))


STANDARD = Standardisation(np.zeros(6), np.ones(6), 2.0)


@pytest.mark.parametrize(
    ("label", "shape", "standardisation", "says"),
    [
        ("vgg16", (4, 9), None, r"takes inputs of shape \(4, 9\), needed is \(4, 6\)"),
        ("vgg16", (3, 6), None, r"takes inputs of shape \(3, 6\), needed is \(4, 6\)"),
        ("vgg16", (4, 6), STANDARD, "does standardise its inputs"),
        ("vgg16_box_nobox", (4, 6), None, "does not standardise its inputs"),
        ("vgg16", None, None, "is no Keras model"),
    ],
)
def test_a_model_that_does_not_fit_is_refused(trained, tmp_path, label, shape, standardisation, says):
    path = tmp_path / "model.keras"
    path.write_text("no model")
    if shape:
        vgg16.build(*shape, standardisation).save(path)
        problem = parse(label).surrogate.misfit(stored_layers(path), 4, 3, parse(label).settings)
        assert re.fullmatch(says, problem)
    with pytest.raises(InputError, match=says):
        trained(label, "first", slurry(1), start_from=str(path))


def test_layers_have_to_fit(trained, tmp_path, monkeypatch):
    vgg16.build(4, 6).save(tmp_path / "model.keras")
    assert parse("vgg16").surrogate.misfit(stored_layers(tmp_path / "model.keras"), 4, 3, {}) is None
    monkeypatch.setattr(vgg16, "DENSE_UNITS", 32)
    with pytest.raises(InputError, match="has other layers than the published network"):
        trained("vgg16", "second", slurry(1), start_from=str(tmp_path / "model.keras"))
