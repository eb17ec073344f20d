"""VGG16: the published layers, and a faster training that is the same mathematics."""

import itertools
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from damage import flip, truncate
from slurrycast import surrogates
from slurrycast.analysis.errors import coordinate_errors
from slurrycast.data.dataset import split
from slurrycast.data.features import particle_history
from slurrycast.data.frames import read_frames
from slurrycast.data.tables import read_table
from slurrycast.runtime.files import InputError, RunError
from slurrycast.surrogates import vgg16
from slurrycast.surrogates.checkpoint import has_settled
from slurrycast.surrogates.prediction import PredictionInput
from structures import training_set

# Table 2 of the article, (length, channels) behind each layer and its parameters.
TABLE_2 = [
    ("block1_conv1", (4, 64), 1_216),
    ("block1_conv2", (4, 64), 12_352),
    ("block1_pool", (2, 64), 0),
    ("block2_conv1", (2, 128), 24_704),
    ("block2_conv2", (2, 128), 49_280),
    ("block2_pool", (1, 128), 0),
    ("block3_conv1", (1, 256), 98_560),
    ("block3_conv2", (1, 256), 196_864),
    ("block3_conv3", (1, 256), 196_864),
    ("block3_pool", (1, 256), 0),
    ("block4_conv1", (1, 512), 393_728),
    ("block4_conv2", (1, 512), 786_944),
    ("block4_conv3", (1, 512), 786_944),
    ("block4_pool", (1, 512), 0),
    ("block5_conv1", (1, 512), 786_944),
    ("block5_conv2", (1, 512), 786_944),
    ("block5_conv3", (1, 512), 786_944),
    ("block5_pool", (1, 512), 0),
    ("flatten", (512,), 0),
    ("dense1", (4096,), 2_101_248),
    ("dense2", (4096,), 16_781_312),
    ("coordinates_um", (3,), 12_291),
]

SETTINGS = {"epochs": 5, "batch_size": 16, "learning_rate": 1e-3, "threads": 1, "seed": 11}


@pytest.fixture(scope="module")
def full():
    import keras

    vgg16.make_deterministic(seed=3, threads=1)
    model = vgg16.build(4, 6)
    yield model
    keras.backend.clear_session()


def samples(n, n_frames=4, seed=0):
    """Features like those of particles and targets that follow from them: a shrinking box."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(-9, 9, (n, 1, 3)) * np.linspace(1, 0.95, n_frames)[:, None]
    static = np.concatenate([rng.integers(1, 4, (n, 1, 1)), rng.uniform(0.25, 0.55, (n, 1, 1))], axis=2)
    coordination = rng.integers(0, 9, (n, n_frames, 1))
    features = np.concatenate([np.repeat(static, n_frames, axis=1), place, coordination], axis=2)
    return features, 0.7 * place[:, -1] + rng.normal(0, 0.1, (n, 3))


def shrinking_slurry(n=80):
    features, targets = samples(n)
    edges_um = 20 * np.linspace(1, 0.95, 4)[:, None] * np.ones(3)
    return training_set(features, targets, edges_um[None], 0.7 * edges_um[None, -1])


def test_layers_are_those_of_table_2(full):
    from keras import layers

    rows = [(layer.name, layer.output.shape[1:], layer.count_params()) for layer in full.layers[1:]]
    assert rows == TABLE_2
    assert full.count_params() == 23_803_139
    for layer in full.layers:
        if isinstance(layer, layers.Conv1D):
            assert (layer.kernel_size, layer.padding, layer.activation.__name__) == ((3,), "same", "relu")
        elif isinstance(layer, layers.MaxPooling1D):
            assert (layer.pool_size, layer.strides, layer.padding) == ((2,), (2,), "same")
    assert [layer.activation.__name__ for layer in full.layers[-3:]] == ["relu", "relu", "linear"]


def forward_in_float64(model, x):
    """The network in plain numpy: an independent statement of what the layers do."""
    for layer in model.layers[1:]:
        weights = [weight.astype(float) for weight in layer.get_weights()]
        if "conv" in layer.name:
            padded = np.pad(x, ((0, 0), (1, 1), (0, 0)))
            taps = (padded[:, tap : tap + x.shape[1]] @ weights[0][tap] for tap in range(3))
            x = np.maximum(sum(taps) + weights[1], 0)
        elif "pool" in layer.name:
            padded = np.pad(x, ((0, 0), (0, x.shape[1] % 2), (0, 0)), constant_values=-np.inf)
            x = np.maximum(padded[:, ::2], padded[:, 1::2])
        elif layer.name == "flatten":
            x = x.reshape(len(x), -1)
        else:
            x = x @ weights[0] + weights[1]
            x = x if layer is model.layers[-1] else np.maximum(x, 0)
    return x


def test_prediction_keeps_coordinates_to_a_thousandth_of_a_um(full, tmp_path):
    features, _ = samples(40)
    exact = forward_in_float64(full, features)
    scale = 100 / abs(exact).max()  # coordinates as large as in the largest slurries
    last = full.layers[-1].get_weights()
    full.layers[-1].set_weights([weight * scale for weight in last])
    full.save(tmp_path / "model.keras")
    full.layers[-1].set_weights(last)
    predicted = vgg16.apply_model(tmp_path / "model.keras", features)
    assert predicted.dtype == np.float64
    assert abs(predicted).max() > 99
    np.testing.assert_allclose(predicted, exact * scale, atol=1e-3, rtol=0)


def assert_same_prediction(trainer, model, features):
    theirs = model.predict_on_batch(features)
    np.testing.assert_allclose(trainer.predict_on_batch(features), theirs, rtol=0, atol=1e-5 * abs(theirs).max())


def assert_same_training(model, n_frames, steps, tolerance):
    import keras

    start = model.get_weights()
    trainer = vgg16.Trainer(model, 1e-3)
    model.compile(optimizer=keras.optimizers.Adamax(1e-3), loss="mse", metrics=["mae"], run_eagerly=True)
    for step in range(steps):
        features, targets = (array.astype(np.float32) for array in samples(20, n_frames, seed=step))
        assert_same_prediction(trainer, model, features)
        ours = [float(value) for value in trainer.train_on_batch(features, targets, np.ones((20, 1), np.float32))]
        model.reset_metrics()
        np.testing.assert_allclose(ours, model.train_on_batch(features, targets), rtol=1e-6)
    theirs = model.get_weights()
    trainer.write_back(model, [weight.numpy() for weight in trainer.weights])
    for ours, other, before in zip(model.get_weights(), theirs, start, strict=True):
        assert np.linalg.norm(ours - other) < tolerance * np.linalg.norm(other - before)
    assert_same_prediction(trainer, model, features)


def test_training_equals_keras_with_adamax(full):
    assert_same_training(full, n_frames=4, steps=3, tolerance=5e-3)


@pytest.mark.parametrize("n_frames", [1, 2, 5, 40])
def test_training_equals_keras_for_any_number_of_frames(small, n_frames):
    vgg16.make_deterministic(seed=3, threads=1)
    assert_same_training(vgg16.build(n_frames, 6), n_frames, steps=10, tolerance=1e-3)


def fit(folder, data=None, held_out=None, **changes):
    folder.mkdir(exist_ok=True)
    spent = vgg16.Vgg16().train(data or shrinking_slurry(), SETTINGS | changes, folder, held_out)
    return (folder / "history.csv").read_text(), vgg16.apply_model(folder / "model.keras", samples(20)[0]), spent


def test_the_same_seed_gives_the_same_network(small, tmp_path):
    history, predicted, spent = fit(tmp_path / "a")
    assert spent == {"wall_s": 0.0, "cpu_s": 0.0}
    again = fit(tmp_path / "b")
    assert again[0] == history
    np.testing.assert_array_equal(again[1], predicted)
    assert fit(tmp_path / "c", seed=12)[0] != history


def test_training_learns(small, tmp_path):
    fit(tmp_path, epochs=60, learning_rate=3e-3)
    loss = np.loadtxt(tmp_path / "history.csv", delimiter=",", skiprows=1)[:, 1]
    assert loss[-1] < 0.2 * loss[0]


def killed_in_epoch(monkeypatch, epoch):
    train_epoch, epochs = vgg16.Trainer.train_epoch, itertools.count(1)

    def dies(*args):
        if next(epochs) == epoch:
            raise KeyboardInterrupt
        return train_epoch(*args)

    monkeypatch.setattr(vgg16.Trainer, "train_epoch", dies)


def test_a_killed_training_ends_like_an_undisturbed_one(small, tmp_path, monkeypatch, capsys):
    def scripted_errors(trainer, *_):
        epoch = int(trainer.variables["steps"][0]) // 4  # 64 training samples in batches of 16
        return np.array([[5.0, 1.0, 3.0, 2.0, 4.0][epoch - 1]] * 2)

    monkeypatch.setattr(vgg16.Trainer, "errors", scripted_errors)
    undisturbed = fit(tmp_path / "undisturbed")
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        killed_in_epoch(patch, 5)
        fit(tmp_path / "killed")
    assert not (tmp_path / "killed" / "model.keras").exists()
    capsys.readouterr()
    resumed = fit(tmp_path / "killed")
    assert "resuming after epoch 4" in capsys.readouterr().out
    assert resumed[0] == undisturbed[0]
    np.testing.assert_array_equal(resumed[1], undisturbed[1])
    assert resumed[2]["wall_s"] > 0 and resumed[2]["cpu_s"] > 0
    # the best epoch, the second, came before the kill
    np.testing.assert_array_equal(resumed[1], fit(tmp_path / "two", epochs=2)[1])


@pytest.mark.parametrize(
    ("patience", "min_improvement", "epochs"), [(2, 0.5, 3), (2, 0.49, 4), (3, 0.49, 5), (1, 0.0, 3), (None, 0.9, 5)]
)
def test_a_training_ends_when_its_lowest_validation_loss_has_settled(
    small, tmp_path, monkeypatch, patience, min_improvement, epochs
):
    """Also one that was killed between its last epoch and the writing of the model."""
    losses = iter([4.0, 2.0, 3.0, 2.0, 1.01])

    def scripted_errors(*_):
        return np.array([next(losses)] * 2)

    def dies(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(vgg16.Trainer, "errors", scripted_errors)
    settings = {"patience": patience, "min_improvement": min_improvement}
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(vgg16, "write_history", dies)
        fit(tmp_path, **settings)
    history, *_ = fit(tmp_path, **settings)
    assert len(history.splitlines()) - 1 == epochs
    assert has_settled([4.0, 2.0, 3.0, 2.0, 1.01][:epochs], settings) == (epochs < 5)


def test_more_epochs_go_on_where_fewer_ended(small, tmp_path, capsys):
    expected = {epochs: fit(tmp_path / str(epochs), epochs=epochs)[:2] for epochs in (2, 5)}
    for epochs, said in ((2, "epoch 1/2"), (5, "resuming after epoch 2"), (2, "of more epochs: starting anew")):
        capsys.readouterr()
        history, predicted, _ = fit(tmp_path / "extended", epochs=epochs)
        assert said in capsys.readouterr().out
        assert history == expected[epochs][0]
        np.testing.assert_array_equal(predicted, expected[epochs][1])


def two_slurries():
    features, targets = samples(30, seed=5)
    edges_um = np.broadcast_to(20 * np.linspace(1, 0.95, 4)[:, None], (2, 4, 3))
    return training_set(features, targets + np.array([0.3, 0, 0]), edges_um, 0.7 * edges_um[:, -1])


def test_held_out_slurries_are_looked_at_and_change_nothing(small, tmp_path, monkeypatch):
    """Their errors, at a few epochs, are those that tables have of the predictions; a killed training has the same."""
    alone = fit(tmp_path / "alone")
    test = two_slurries()
    held_out = {"test": test}
    looked = fit(tmp_path / "looked", held_out=held_out)
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        killed_in_epoch(patch, 4)
        fit(tmp_path / "killed", held_out=held_out)
    assert fit(tmp_path / "killed", held_out=held_out)[0] == looked[0]
    np.testing.assert_array_equal(looked[1], alone[1])
    history = read_table(tmp_path / "looked" / "history.csv")
    pd.testing.assert_frame_equal(history.iloc[:, :5], read_table(tmp_path / "alone" / "history.csv"))
    assert list(history.columns[5:]) == ["test_slurries_loss", "test_slurries_mae"]
    assert history.epoch[history.test_slurries_loss.notna()].tolist() == [1, 2, 4]
    fit(tmp_path / "first", held_out=held_out, epochs=1)
    predicted_um = vgg16.apply_model(tmp_path / "first" / "model.keras", test.features)
    slurries = [test.slurry_index == k for k in (0, 1)]
    errors = [coordinate_errors(test.targets[of], predicted_um[of])["all"] for of in slurries]
    assert history.test_slurries_loss[0] == pytest.approx(np.mean([e.mse_um2 for e in errors]), rel=1e-4)
    assert history.test_slurries_mae[0] == pytest.approx(np.mean([e.mae_um for e in errors]), rel=1e-4)


def test_a_foreign_or_damaged_checkpoint_is_ignored(small, tmp_path, monkeypatch, capsys):
    expected, *_ = fit(tmp_path / "clean")
    checkpoint = tmp_path / "killed" / "checkpoint.h5"
    for damage, batch_size in ((None, 8), (truncate, 16), (flip, 16)):
        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            killed_in_epoch(patch, 3)
            fit(checkpoint.parent, batch_size=batch_size)
        if damage:
            damage(checkpoint)
        capsys.readouterr()
        assert fit(checkpoint.parent)[0] == expected
        assert "starting anew" in capsys.readouterr().out
        checkpoint.unlink()


def test_a_loss_that_is_not_finite_stops(small, tmp_path):
    with pytest.raises(RunError, match=r"not finite in epoch \d, learning_rate 1e\+20 is too large"):
        fit(tmp_path, learning_rate=1e20)
    assert not (tmp_path / "model.keras").exists()


@pytest.mark.parametrize("key", ["epochs", "batch_size", "learning_rate", "threads"])
def test_settings_are_checked(tmp_path, key):
    with pytest.raises(InputError, match=f"setting {key} is 0, it must be above 0"):
        fit(tmp_path, **{key: 0})


def test_the_model_is_plain_keras(small, tmp_path):
    _, predicted, _ = fit(tmp_path, epochs=1)
    np.save(tmp_path / "features.npy", samples(20)[0])
    code = """
import sys, numpy, keras
model = keras.saving.load_model("model.keras", safe_mode=True)
numpy.save("predicted.npy", model.predict(numpy.load("features.npy"), verbose=0))
assert not [name for name in sys.modules if "slurrycast" in name]
"""
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)
    np.testing.assert_allclose(np.load(tmp_path / "predicted.npy"), predicted, atol=1e-5)


def test_models_that_do_not_fit_are_refused(small, tmp_path):
    path = tmp_path / "model.keras"
    features, _ = samples(5)
    for _ in range(2):
        with pytest.raises(InputError, match=r"model\.keras: not a readable Keras model"):
            vgg16.apply_model(path, features)
        path.write_bytes(b"no model")
    vgg16.build(2, 6).save(path)
    with pytest.raises(InputError, match=r"maps \(2, 6\) to \(3,\), needed is \(4, 6\) to \(3,\)"):
        vgg16.apply_model(path, features)


@pytest.fixture
def untrained(small, tmp_path):
    vgg16.build(4, 6).save(tmp_path / "model.keras")
    return tmp_path / "model.keras"


@pytest.fixture
def asked(slurry):
    with read_frames(slurry / "frames.h5") as store:
        return PredictionInput("A", store.particles, tuple(store.frame(k) for k in (7, 8, 9, 10)))


def test_an_input_is_answered_with_what_the_network_makes_of_its_history(untrained, asked):
    prediction = vgg16.Vgg16().predict(asked, untrained, {})
    history = particle_history(asked.particles, asked.frames)
    np.testing.assert_array_equal(prediction.position_um, vgg16.apply_model(untrained, history))
    assert prediction.edges_um is None


def test_prediction_does_not_depend_on_the_batches(untrained, monkeypatch):
    features, _ = samples(50)
    whole = vgg16.apply_model(untrained, features)
    monkeypatch.setattr(vgg16, "PREDICTION_BATCH", 7)
    np.testing.assert_allclose(vgg16.apply_model(untrained, features), whole, atol=1e-6)


@pytest.mark.parametrize(("settings", "scales"), [({"change": "relative"}, True), ({}, False)])
def test_relative_coordinates_know_nothing_of_the_size_of_the_box(untrained, asked, settings, scales):
    """A slurry that is three times as wide is predicted three times as wide; with coordinates in um it is not."""
    wider = tuple(replace(f, position_um=3 * f.position_um, edges_um=3 * f.edges_um) for f in asked.frames)
    once, thrice = (
        vgg16.Vgg16().predict(replace(asked, frames=frames), untrained, settings).position_um
        for frames in (asked.frames, wider)
    )
    assert np.allclose(3 * once, thrice, rtol=1e-4, atol=1e-3) == scales


def test_relative_training_is_in_um_too(small, tmp_path):
    """Where all boxes are RELATIVE_EDGE_UM wide at the last input frame, it is the same training."""
    data = replace(shrinking_slurry(), input_edges_um=np.full((1, 4, 3), vgg16.RELATIVE_EDGE_UM))
    assert fit(tmp_path / "um", data)[0] == fit(tmp_path / "relative", data, change="relative")[0]


@pytest.fixture
def unlike():
    """Samples whose features and targets are of very different sizes, one feature always the same."""
    features, targets = samples(80)
    features[..., 0] = 2.0
    features[..., 5] += 1000
    return vgg16.Samples(features, 1e-3 * targets, np.full((80, 1), 5.0), split(80, 0.2, seed=1))


def test_standardised_samples_have_mean_0_and_deviation_1(unlike):
    seen = vgg16.Standardisation.fitted(unlike).apply(unlike)
    trained = ~unlike.is_validation
    np.testing.assert_allclose(seen.features[trained].mean(axis=(0, 1)), 0, atol=1e-10)
    np.testing.assert_allclose(seen.features[trained].std(axis=(0, 1)), [0, 1, 1, 1, 1, 1], atol=1e-10)
    assert np.mean(seen.targets[trained] ** 2) == pytest.approx(1)
    np.testing.assert_allclose(seen.targets * seen.unit_um, unlike.targets * unlike.unit_um, rtol=1e-12)
    # the held-out samples have no say
    outlier = replace(unlike, features=np.where(unlike.is_validation[:, None, None], 1e9, unlike.features))
    np.testing.assert_array_equal(
        vgg16.Standardisation.fitted(outlier).feature_mean, vgg16.Standardisation.fitted(unlike).feature_mean
    )


def test_the_written_model_standardises_by_itself(small, unlike, tmp_path):
    """History, in um2 and um, against the errors of what the file predicts from samples as they are."""
    vgg16.train("any", unlike, True, SETTINGS | {"epochs": 1}, tmp_path)
    *_, val_loss, val_mae = np.loadtxt(tmp_path / "history.csv", delimiter=",", skiprows=1)
    error_um = (
        5.0 * (vgg16.apply_model(tmp_path / "model.keras", unlike.features) - unlike.targets)[unlike.is_validation]
    )
    assert val_loss == pytest.approx(np.mean(error_um**2), rel=1e-3)
    assert val_mae == pytest.approx(np.mean(abs(error_um)), rel=1e-3)


def test_the_standardised_variant_sees_numbers_of_one_size(small, tmp_path):
    """Whatever the size of the box: its losses are those of the same slurry in other units, of vgg16 they are not."""
    data = shrinking_slurry()
    standardised = surrogates.parse("vgg16_standardised").settings
    for settings, alike in ((standardised, True), ({}, False)):
        losses = []
        for factor in (1, 4):
            larger = replace(data, features=data.features * [1, 1, *[factor] * 3, 1], targets=factor * data.targets)
            folder = tmp_path / f"{alike}_{factor}"
            fit(folder, larger, **settings)
            losses.append(np.loadtxt(folder / "history.csv", delimiter=",", skiprows=1)[:, 1] / factor**2)
        assert np.allclose(*losses, rtol=1e-3) == alike


def test_the_unit_weighs_the_error(small):
    """Loss and mean absolute error of (prediction - target) x unit, while training and after."""
    vgg16.make_deterministic(seed=3, threads=1)
    features, targets = (array.astype(np.float32) for array in samples(20))
    unit_um = np.random.default_rng(4).uniform(1, 3, (20, 3)).astype(np.float32)
    trainer = vgg16.Trainer(vgg16.build(4, 6), 1e-3)
    error_um = (trainer.predict_on_batch(features) - targets) * unit_um
    expected = [np.mean(error_um**2), np.mean(abs(error_um))]
    np.testing.assert_allclose(trainer.errors(features, targets, unit_um), expected, rtol=1e-6)
    np.testing.assert_allclose(np.stack(trainer.train_on_batch(features, targets, unit_um)), expected, rtol=1e-6)
