"""Rules for the final box, in closed form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slurrycast.data.final_box import scale_of_prediction, scale_to_packing_fraction

LAST_UM = np.random.default_rng(1).normal(size=(200, 3)) * [1, 2, 3]


@given(st.floats(0.05, 20), st.sampled_from([1, -1, 0]))
def test_scaled_coordinates_give_their_scale(scale, sign):
    """Also if they are mirrored or all the same, whose boxes predict_slurry refuses."""
    assert scale_of_prediction(sign * scale * LAST_UM, LAST_UM) == pytest.approx(sign * scale, rel=1e-12)


def test_it_is_the_least_squares_scale():
    predicted_um = 0.8 * LAST_UM + np.random.default_rng(2).normal(size=LAST_UM.shape)
    expected = np.linalg.lstsq(LAST_UM.reshape(-1, 1), predicted_um.ravel(), rcond=None)[0][0]
    assert scale_of_prediction(predicted_um, LAST_UM) == pytest.approx(expected, rel=1e-12)


def test_deviations_that_do_not_correlate_with_the_coordinates_leave_it_unchanged():
    """A common shift on top of coordinates that are centred about the box centre, as an example."""
    centred_um = LAST_UM - LAST_UM.mean(axis=0)
    assert scale_of_prediction(0.7 * centred_um + [5.0, -3.0, 1.0], centred_um) == pytest.approx(0.7, rel=1e-12)


def test_packing_fraction_of_the_scaled_box():
    edges_um = np.array([4.0, 5.0, 10.0])
    assert scale_to_packing_fraction(0.5, 100.0, edges_um) == pytest.approx(1.0)
    scale = scale_to_packing_fraction(0.64, 50.0, edges_um)
    assert 50.0 / np.prod(scale * edges_um) == pytest.approx(0.64, rel=1e-12)
