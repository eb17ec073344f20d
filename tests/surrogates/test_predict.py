"""The prediction of one slurry, by the script and a small Keras model."""

import json
import subprocess

import numpy as np
import pytest

from slurrycast import surrogates
from slurrycast.data.frames import read_frames, write_frames
from slurrycast.runtime.files import RunError
from slurrycast.surrogates.prediction import Prediction

LAST_INPUT = 10


def last_times(factor: float, n_frames: int, path):
    """Save a model that returns the last of some input coordinates times a factor; its path."""
    import keras

    inputs = keras.Input((n_frames, 6))
    dense = keras.layers.Dense(3, use_bias=False)
    model = keras.Model(inputs, dense(keras.layers.Flatten()(inputs)))
    kernel = np.zeros((6 * n_frames, 3))
    kernel[-4:-1] = factor * np.eye(3)
    dense.set_weights([kernel])
    model.save(path)
    return path


@pytest.fixture
def predict(run_main, slurry, tmp_path):
    """Predict; the path of the prediction. Options are those of a surrogate that needs nothing, at frames 9 and 10."""

    def run(surrogate, predicted="predicted.h5", **options):
        defaults = {"settings": "{}", "frames": slurry / "frames.h5", "input_frames": [9, 10], "target_frame": 120}
        outputs = {"predicted": tmp_path / predicted, "cost": tmp_path / "cost.json"}
        run_main("predict_slurry", surrogate=surrogate, **(defaults | outputs | options))
        return tmp_path / predicted

    return run


def test_prediction_and_its_box_follow_from_the_input_frames_alone(predict, slurry, tmp_path):
    """A store that ends at the last input frame gives the same file, to the bit, as one of the whole run."""
    options = {"model": last_times(0.8, 4, tmp_path / "model.keras"), "input_frames": [7, 8, 9, LAST_INPUT]}
    whole = predict("vgg16", "whole.h5", **options)
    with read_frames(slurry / "frames.h5") as store, read_frames(whole) as predicted:
        write_frames(tmp_path / "cut.h5", store.particles, map(store.frame, range(LAST_INPUT + 1)), store.attributes)
        assert predicted.attributes["box_scale"] == pytest.approx(0.8, rel=1e-6)
        assert predicted.attributes["box_rule"] == "scale_of_prediction"
        np.testing.assert_allclose(predicted.box(120)[1], 0.8 * store.box(LAST_INPUT)[1], rtol=1e-6)
        np.testing.assert_allclose(predicted.position_um(120), 0.8 * store.position_um(LAST_INPUT), atol=1e-5)
        assert (predicted.steps[0], predicted.times_us[0]) == (store.steps[120], store.times_us[120])
        assert predicted.attributes["physics"] == store.attributes["physics"]
    cut = predict("vgg16", "cut_predicted.h5", **options, frames=tmp_path / "cut.h5")
    assert whole.read_bytes() == cut.read_bytes()


def test_persistence_is_the_last_input_frame_in_its_box(predict, slurry):
    with read_frames(predict("persistence")) as predicted, read_frames(slurry / "frames.h5") as store:
        np.testing.assert_array_equal(predicted.position_um(120), store.position_um(10))
        np.testing.assert_array_equal(predicted.box(120)[1], store.box(10)[1])


def test_affine_map_keeps_scaled_coordinates_and_ends_at_the_packing_fraction(predict, slurry, tmp_path):
    packing = tmp_path / "packing.json"
    packing.write_text('{"mean": 0.66}')
    path = predict("affine_f02", input_frames=[0, 1, 2], packing=packing)
    with read_frames(path) as predicted, read_frames(slurry / "frames.h5") as store:
        radius_um = store.particles.radius_um
        assert (4 / 3 * np.pi * radius_um**3).sum() / predicted.volume_um3(120) == pytest.approx(0.66, rel=1e-9)
        np.testing.assert_allclose(predicted.scaled_position(120), store.scaled_position(2), atol=1e-12)
        assert predicted.attributes["box_rule"] == "mean_packing_fraction"
        assert list(predicted.attributes["input_frames"]) == [0, 1, 2]


@pytest.mark.parametrize(
    ("surrogate", "option"), [("affine", "--packing"), ("vgg16", "--model"), ("early_dem_x2", "--inputs, --restart")]
)
def test_what_a_surrogate_needs_is_asked_for(predict, capsys, surrogate, option):
    with pytest.raises(SystemExit) as end:
        predict(surrogate)
    assert end.value.code == 2
    assert f"{surrogate} needs {option}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("surrogate", "options", "option", "content", "advice"),
    [
        ("vgg16", {}, "model", None, ": train longer (surrogate.vgg16.epochs)"),
        (
            *("vgg16", {"adopted": []}, "model", None),
            ": check that the one in surrogate.models was trained on this recipe, scale and input frames",
        ),
        ("linear", {}, "model", {"input_frames": [9, 10], "coefficients": [0, 0.1]}, ""),
        (
            *("affine", {}, "packing", {"mean": 1.5}),
            ": check surrogate.packing_fraction, or without it the densities of the training slurries",
        ),
    ],
)
def test_advice_on_a_box_that_is_too_small_fits_the_model(
    predict, tmp_path, surrogate, options, option, content, advice
):
    """All shrink the box at the last frame to 0.1 of its edges or to a packing fraction above 1."""
    if content is None:
        path = last_times(0.1, 2, tmp_path / "model.keras")
    else:
        path = tmp_path / "model.json"
        path.write_text(json.dumps(content))
    with pytest.raises(RunError) as error:
        predict(surrogate, **options, **{option: path})
    assert str(error.value).endswith(f"which cannot hold its particles{advice}")
    assert not (tmp_path / "predicted.h5").exists()


@pytest.fixture
def doubtful(predict, monkeypatch):
    """Predict by a surrogate that stays where it is and has this spread (n, 3); the path of the prediction."""

    def run(spread_um):
        def answer(inputs, *_):
            return Prediction(inputs.last.position_um, spread_um=spread_um)

        monkeypatch.setattr(surrogates.load("persistence"), "predict", answer)
        return predict("persistence", "p.h5")

    return run


def test_the_spread_of_a_prediction_is_kept(doubtful, slurry):
    with read_frames(slurry / "frames.h5") as store:
        spread_um = np.random.default_rng(1).uniform(0.1, 0.3, (len(store.particles), 3))
    with read_frames(doubtful(spread_um)) as predicted:
        np.testing.assert_array_equal(predicted.position_spread_um(120), spread_um)
    with read_frames(doubtful(None)) as predicted:
        assert predicted.position_spread_um(120) is None


@pytest.mark.parametrize("wrong", [0.0, -0.1, np.nan, np.inf])
def test_a_spread_that_is_none_is_refused(doubtful, slurry, tmp_path, wrong):
    with read_frames(slurry / "frames.h5") as store:
        spread_um = np.full((len(store.particles), 3), 0.1)
    spread_um[3, 1] = wrong
    with pytest.raises(RunError, match=r"persistence: predicts spreads of slurry \w+ that are not finite and above 0"):
        doubtful(spread_um)
    assert not (tmp_path / "p.h5").exists()


def test_packing_fraction_of_the_training_slurries(command, slurry, tmp_path):
    options = {"frames": slurry / "frames.h5", "target_frame": 120, "packing": tmp_path / "packing.json"}
    subprocess.run(command("measure_packing", **options, cost=tmp_path / "c.json"), check=True)
    measured = json.loads((tmp_path / "packing.json").read_text())
    with read_frames(slurry / "frames.h5") as store:
        expected = (4 / 3 * np.pi * store.particles.radius_um**3).sum() / store.volume_um3(120)
        assert measured["mean"] == pytest.approx(expected)
        assert measured["slurries"] == {store.attributes["slurry"]: measured["mean"]}
        assert measured["source"] == "dem"
    words = command("measure_packing", given=0.5, packing=tmp_path / "p.json", cost=tmp_path / "c.json")
    subprocess.run(words, check=True)
    assert json.loads((tmp_path / "p.json").read_text()) == {"mean": 0.5, "source": "configuration", "slurries": {}}
