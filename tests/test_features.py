"""What a model sees of a particle: every value against the frame store it was written to."""

import numpy as np
import pytest

from slurrycast.features import FEATURE_NAMES, particle_history
from slurrycast.files import InputError
from slurrycast.frames import Frame, Particles, read_frames, write_frames


@pytest.fixture
def store_path(tmp_path):
    particles = Particles(
        id=np.array([1, 2, 3]),
        type=np.array([1, 2, 3]),
        phase=np.array([1, 2, 2]),
        size_class=np.array([1, 1, 2]),
        radius_um=np.array([0.55, 0.3, 0.4]),
        mass_pg=np.ones(3),
        phase_names=("A", "B"),
    )
    frames = [
        Frame(
            number=k,
            step=k,
            time_us=float(k),
            position_um=100.0 * k + np.arange(9.0).reshape(3, 3),
            scaled_position=np.zeros((3, 3)),
            coordination=np.array([k, k + 1, k + 2], dtype=np.int32),
            lower_um=-np.ones(3),
            edges_um=2 * np.ones(3),
        )
        for k in range(12)
    ]
    write_frames(tmp_path / "a.h5", particles, frames, {})
    return tmp_path / "a.h5"


def test_history_holds_each_quantity_of_each_frame_in_its_place(store_path):
    assert FEATURE_NAMES == ("phase", "radius_um", "x_um", "y_um", "z_um", "coordination")
    with read_frames(store_path) as store:
        history = particle_history(store, [7, 8, 9, 10])
    assert history.shape == (3, 4, 6)
    assert history.dtype == np.float64
    for column, frame in enumerate((7, 8, 9, 10)):
        np.testing.assert_array_equal(history[:, column, 0], [1, 2, 2])
        np.testing.assert_array_equal(history[:, column, 1], [0.55, 0.3, 0.4])
        np.testing.assert_array_equal(history[:, column, 2:5], 100 * frame + np.arange(9).reshape(3, 3))
        np.testing.assert_array_equal(history[:, column, 5], [frame, frame + 1, frame + 2])


def test_frames_stand_in_the_order_asked_for(store_path):
    with read_frames(store_path) as store:
        np.testing.assert_array_equal(particle_history(store, [9, 2]), particle_history(store, [2, 9])[:, ::-1])


def test_frame_that_the_store_does_not_hold_is_an_input_error(store_path):
    with read_frames(store_path) as store, pytest.raises(InputError, match="frame 12 is not in the file"):
        particle_history(store, [10, 12])
