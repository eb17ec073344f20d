"""The prediction of one slurry, by the script and a small Keras model."""

import subprocess

import h5py
import numpy as np
import pytest

from slurrycast.frames import Frame, read_frames, write_frames

LAST_INPUT = 10


def frame_of(store, k: int) -> Frame:
    lower_um, edges_um = store.box(k)
    return Frame(
        number=k,
        step=int(store.steps[k]),
        time_us=float(store.times_us[k]),
        position_um=store.position_um(k),
        scaled_position=store.scaled_position(k),
        coordination=store.coordination(k),
        lower_um=lower_um,
        edges_um=edges_um,
    )


def arrays(path) -> dict[str, np.ndarray]:
    """All data of an HDF5 file by name."""
    found = {}

    def keep(name, item):
        if isinstance(item, h5py.Dataset):
            found[name] = item[()]

    with h5py.File(path) as file:
        file.visititems(keep)
    return found


@pytest.fixture(scope="module")
def shrinking(tmp_path_factory):
    """A model that returns the last input coordinates times 0.8: what a slurry does on average."""
    import keras

    inputs = keras.Input((4, 6))
    last = keras.layers.Cropping1D((3, 0))(inputs)
    dense = keras.layers.Dense(3, use_bias=False)
    model = keras.Model(inputs, dense(keras.layers.Flatten()(last)))
    kernel = np.zeros((6, 3))
    kernel[2:5] = 0.8 * np.eye(3)
    dense.set_weights([kernel])
    path = tmp_path_factory.mktemp("model") / "model.keras"
    model.save(path)
    return path


@pytest.fixture
def predict(command, shrinking, tmp_path):
    def run(frames, predicted):
        options = {"surrogate": "vgg16", "model": shrinking, "input_frames": [7, 8, 9, LAST_INPUT], "target_frame": 120}
        words = command("predict_slurry", **options, frames=frames, predicted=predicted, cost=tmp_path / "cost.json")
        return subprocess.run(words, capture_output=True, text=True)

    return run


def test_prediction_and_its_box_follow_from_the_input_frames_alone(predict, slurry, tmp_path):
    """A store that ends at the last input frame gives the same file, to the bit, as one of the whole run."""
    with read_frames(slurry / "frames.h5") as store:
        frames = [frame_of(store, k) for k in range(LAST_INPUT + 1)]
        write_frames(tmp_path / "cut.h5", store.particles, frames, store.attributes)
    assert predict(slurry / "frames.h5", tmp_path / "whole_predicted.h5").returncode == 0
    assert predict(tmp_path / "cut.h5", tmp_path / "cut_predicted.h5").returncode == 0
    whole, cut = (arrays(tmp_path / f"{name}_predicted.h5") for name in ("whole", "cut"))
    assert whole.keys() == cut.keys()
    for name, values in whole.items():
        np.testing.assert_array_equal(values, cut[name], err_msg=name)


def test_box_and_time_of_the_prediction(predict, slurry, tmp_path):
    assert predict(slurry / "frames.h5", tmp_path / "predicted.h5").returncode == 0
    with read_frames(slurry / "frames.h5") as store, read_frames(tmp_path / "predicted.h5") as predicted:
        assert predicted.attributes["box_scale"] == pytest.approx(0.8, rel=1e-6)
        assert predicted.attributes["box_rule"] == "scale_of_prediction"
        np.testing.assert_allclose(predicted.box(120)[1], 0.8 * store.box(LAST_INPUT)[1], rtol=1e-6)
        np.testing.assert_allclose(predicted.position_um(120), 0.8 * store.position_um(LAST_INPUT), atol=1e-5)
        assert (predicted.steps[0], predicted.times_us[0]) == (store.steps[120], store.times_us[120])
        assert predicted.attributes["physics"] == store.attributes["physics"]
