"""What a model sees of a particle: every value against the frames it comes from."""

from dataclasses import replace

import numpy as np

from slurrycast.data.features import FEATURE_NAMES, particle_history
from slurrycast.data.frames import Frame
from structures import frame, particles

PARTICLES = particles(np.array([1, 2, 2]), np.array([0.55, 0.3, 0.4]), ("A", "B"))


def numbered(k: int) -> Frame:
    """Frame whose values show its number."""
    position_um = 100.0 * k + np.arange(9.0).reshape(3, 3)
    contacts = np.array([k, k + 1, k + 2], dtype=np.int32)
    return replace(frame(k, position_um, np.full(3, 2.0)), coordination=contacts)


def test_history_holds_each_quantity_of_each_frame_in_its_place():
    assert FEATURE_NAMES == ("phase", "radius_um", "x_um", "y_um", "z_um", "coordination")
    history = particle_history(PARTICLES, [numbered(k) for k in (7, 9, 8, 10)])
    assert history.shape == (3, 4, 6)
    assert history.dtype == np.float64
    for column, k in enumerate((7, 9, 8, 10)):
        np.testing.assert_array_equal(history[:, column, 0], [1, 2, 2])
        np.testing.assert_array_equal(history[:, column, 1], [0.55, 0.3, 0.4])
        np.testing.assert_array_equal(history[:, column, 2:5], 100 * k + np.arange(9).reshape(3, 3))
        np.testing.assert_array_equal(history[:, column, 5], [k, k + 1, k + 2])
