"""The training set: what is written is read, and what a network could not use is refused."""

import shutil
import subprocess
from dataclasses import replace

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slurrycast.data.dataset import read_training_set, split, write_training_set
from slurrycast.data.frames import read_frames
from slurrycast.runtime.files import CHECKSUMS, InputError
from structures import training_set


@pytest.fixture
def data():
    rng = np.random.default_rng(5)
    edges_um = rng.uniform(5, 9, (2, 4, 3)), rng.uniform(4, 5, (2, 3))
    return training_set(rng.normal(size=(10, 4, 6)), rng.normal(size=(10, 3)), *edges_um)


def test_round_trip_keeps_every_bit(tmp_path, data):
    path = tmp_path / "dataset" / "training.h5"
    write_training_set(path, data, seed=42)
    back = read_training_set(path)
    for name, value in vars(data).items():
        np.testing.assert_array_equal(getattr(back, name), value)
        assert type(getattr(back, name)) is type(value)
    assert back.features.dtype == np.float64
    with h5py.File(path) as file:
        assert file.attrs["seed"] == 42


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"features": np.zeros((10, 3, 6))}, r"features has shape \(10, 3, 6\), expected \(10, 4, 6\)"),
        ({"targets": np.zeros((9, 3))}, r"targets has shape \(9, 3\), expected \(10, 3\)"),
        ({"targets": np.where(np.arange(30).reshape(10, 3) == 13, np.nan, 1.0)}, "1 values are not, .* sample 4"),
        ({"features": np.full((10, 4, 6), np.inf)}, "features must be finite, 240 values"),
        ({"slurry_index": np.full(10, 2)}, "slurry_index must be 0 to 1"),
        ({"is_validation": np.zeros(10, bool)}, "is_validation must be true for some"),
        ({"is_validation": np.arange(10)}, "is_validation must be true for some"),
        ({"input_edges_um": np.ones((2, 3, 3))}, r"input_edges_um has shape \(2, 3, 3\), expected \(2, 4, 3\)"),
        ({"target_edges_um": np.ones((1, 3))}, r"target_edges_um has shape \(1, 3\), expected \(2, 3\)"),
        ({"input_edges_um": np.full((2, 4, 3), np.nan)}, "input_edges_um must be finite and above 0"),
        ({"target_edges_um": np.array([[4.0, 4, 4], [4, 0, 4]])}, "target_edges_um must be finite and above 0"),
    ],
)
def test_unusable_data_are_not_written(tmp_path, data, change, message):
    path = tmp_path / "training.h5"
    with pytest.raises(InputError, match=message):
        write_training_set(path, replace(data, **change), seed=1)
    assert list(tmp_path.iterdir()) == []


def test_reading_refuses_what_writing_refuses(tmp_path, data):
    path = tmp_path / "training.h5"
    write_training_set(path, data, seed=1)
    with h5py.File(path, "r+") as file:
        file["targets"][3, 1] = np.nan
    shutil.rmtree(path.parent / CHECKSUMS)
    with pytest.raises(InputError, match="targets must be finite"):
        read_training_set(path)


def test_unreadable_files_are_named(tmp_path):
    path = tmp_path / "training.h5"
    for says in ("no such file", "not a readable training set"):
        with pytest.raises(InputError, match=rf"training\.h5: {says}"):
            read_training_set(path)
        path.write_bytes(b"no HDF5")


@given(n=st.integers(2, 3000), share=st.floats(0.001, 0.999), seed=st.integers(0, 2**63))
def test_split_draws_the_share(n, share, seed):
    if not 0 < round(n * share) < n:
        with pytest.raises(InputError, match="validation_share"):
            split(n, share, seed)
        return
    mask = split(n, share, seed)
    assert mask.shape == (n,) and mask.dtype == bool
    assert abs(mask.sum() - n * share) <= 0.5
    np.testing.assert_array_equal(mask, split(n, share, seed))


def test_split_depends_on_the_seed_and_favours_no_place():
    assert (split(1000, 0.2, 1) != split(1000, 0.2, 2)).any()
    drawn = np.mean([split(20, 0.2, seed) for seed in range(4000)], axis=0)
    np.testing.assert_allclose(drawn, 0.2, atol=5 * np.sqrt(0.2 * 0.8 / 4000))


def test_assembled_values_are_those_of_the_frame_store(command, slurry, tmp_path):
    """The script against the store; the second slurry is the first one again, so every box appears twice."""
    paths = {"dataset": tmp_path / "training.h5", "cost": tmp_path / "cost.json"}
    options = {"input_frames": [7, 9, 10], "target_frame": 120, "phases": ["BDPD", "NiO", "8YSZ"]}
    options |= {"validation_share": 0.2, "seed": 3}
    words = command("assemble_dataset", frames=[slurry / "frames.h5"] * 2, **options, **paths)
    subprocess.run(words, check=True)
    data = read_training_set(paths["dataset"])
    with read_frames(slurry / "frames.h5") as store:
        n = len(store.particles)
        assert len(data) == 2 * n
        for column, k in enumerate((7, 9, 10)):
            np.testing.assert_array_equal(data.input_edges_um[:, column], [store.box(k)[1]] * 2)
            np.testing.assert_array_equal(data.features[n:, column, 2:5], store.position_um(k))
            # coordinates over edges are the store's scaled ones about the centre
            edges_um = data.input_edges_um[data.slurry_index, column]
            scaled = data.features[:, column, 2:5] / edges_um
            np.testing.assert_allclose(scaled[:n], store.scaled_position(k) - 0.5, rtol=0, atol=1e-9)
        np.testing.assert_array_equal(data.target_edges_um, [store.box(120)[1]] * 2)
        np.testing.assert_array_equal(data.targets[:n], store.position_um(120))
