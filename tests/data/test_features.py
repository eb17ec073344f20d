"""What a model sees of a particle: every value against the frames it comes from."""

import numpy as np
import pytest

from slurrycast.data.features import FEATURE_NAMES, particle_history
from slurrycast.data.frames import Frame, Particles

PARTICLES = Particles(
    id=np.array([1, 2, 3]),
    type=np.array([1, 2, 3]),
    phase=np.array([1, 2, 2]),
    size_class=np.array([1, 1, 2]),
    radius_um=np.array([0.55, 0.3, 0.4]),
    mass_pg=np.ones(3),
    phase_names=("A", "B"),
)


def frame(k: int) -> Frame:
    return Frame(
        number=k,
        step=k,
        time_us=float(k),
        position_um=100.0 * k + np.arange(9.0).reshape(3, 3),
        scaled_position=np.zeros((3, 3)),
        coordination=np.array([k, k + 1, k + 2], dtype=np.int32),
        lower_um=-np.ones(3),
        edges_um=2 * np.ones(3),
    )


def test_history_holds_each_quantity_of_each_frame_in_its_place():
    assert FEATURE_NAMES == ("phase", "radius_um", "x_um", "y_um", "z_um", "coordination")
    history = particle_history(PARTICLES, [frame(k) for k in (7, 8, 9, 10)])
    assert history.shape == (3, 4, 6)
    assert history.dtype == np.float64
    for column, k in enumerate((7, 8, 9, 10)):
        np.testing.assert_array_equal(history[:, column, 0], [1, 2, 2])
        np.testing.assert_array_equal(history[:, column, 1], [0.55, 0.3, 0.4])
        np.testing.assert_array_equal(history[:, column, 2:5], 100 * k + np.arange(9).reshape(3, 3))
        np.testing.assert_array_equal(history[:, column, 5], [k, k + 1, k + 2])


@pytest.mark.parametrize("order", [(9, 2), (2, 9, 5)])
def test_frames_stand_in_the_order_given(order):
    forward, backward = (particle_history(PARTICLES, [frame(k) for k in ks]) for ks in (order, order[::-1]))
    np.testing.assert_array_equal(forward, backward[:, ::-1])
