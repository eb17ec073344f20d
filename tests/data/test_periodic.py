"""Periodic coordinates: closed forms, and wrapping against MDAnalysis."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from MDAnalysis.lib.distances import apply_PBC, minimize_vectors

from slurrycast.data.periodic import minimum_image, to_scaled, wrap

positions = arrays(np.float64, (7, 3), elements=st.floats(-200, 200))
lowers = arrays(np.float64, 3, elements=st.floats(-50, 50))
edges = arrays(np.float64, 3, elements=st.floats(0.5, 60))


@given(positions, lowers, edges)
def test_wrapped_positions_are_inside_and_whole_edges_away(position, lower, edge):
    wrapped = wrap(position, lower, edge)
    assert np.all(wrapped >= lower)
    assert np.all(wrapped < lower + edge)
    boxes = (position - wrapped) / edge
    np.testing.assert_allclose(boxes, np.rint(boxes), rtol=0, atol=1e-9)
    np.testing.assert_array_equal(wrap(wrapped, lower, edge), wrapped)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_no_number_has_no_image(value):
    with np.errstate(invalid="ignore"):
        assert np.isnan(wrap(np.full((1, 3), value), np.zeros(3), np.ones(3))).all()


def test_scaled_coordinates_run_from_the_lower_to_the_upper_corner():
    lower, edge = np.array([-1.0, -2.0, -3.0]), np.array([2.0, 4.0, 6.0])
    corners = np.array([lower, [0, 0, 0], lower + edge])
    np.testing.assert_array_equal(to_scaled(corners, lower, edge), [[0] * 3, [0.5] * 3, [1] * 3])


@pytest.mark.parametrize(
    ("position", "expected"),
    [
        (-1.5, -1.5),
        (1.5, -1.5),  # the upper face is the lower one
        (np.nextafter(1.5, 2), -1.5),
        (np.nextafter(1.5, 0), np.nextafter(1.5, 0)),
        (np.nextafter(-1.5, -2), None),  # its image, 1.5 less a rounding error, is inside or on the lower face
        (-1.5 - 1e-18, -1.5),
        (4.75, -1.25),
        (-4.75, 1.25),
    ],
)
def test_wrap_at_the_faces(position, expected):
    wrapped = wrap(np.full((1, 3), position), np.full(3, -1.5), np.full(3, 3.0))
    assert np.all((wrapped >= -1.5) & (wrapped < 1.5))
    if expected is not None:
        np.testing.assert_allclose(wrapped, expected, rtol=0, atol=1e-15)


def test_wrap_of_a_tiny_negative_coordinate_is_not_the_upper_edge():
    # -1e-20 + 1 rounds to 1, which is outside [0, 1).
    np.testing.assert_array_equal(wrap(np.full((1, 3), -1e-20), np.zeros(3), np.ones(3)), np.zeros((1, 3)))


def test_wrap_agrees_with_mdanalysis():
    rng = np.random.default_rng(1)
    edge, lower = np.array([7.0, 8.5, 14.0]), np.array([-3.5, -4.25, -7.0])
    position = rng.uniform(-40, 40, (5000, 3))
    theirs = apply_PBC((position - lower).astype(np.float32), np.array([*edge, 90, 90, 90], dtype=np.float32)) + lower
    # Float32 may put a position at a face on the other side of it.
    difference = minimum_image(wrap(position, lower, edge) - theirs, edge)
    np.testing.assert_allclose(difference, 0, atol=2e-5)
    assert np.mean(np.abs(wrap(position, lower, edge) - theirs) < 2e-5) > 0.999


@given(arrays(np.float64, (7, 3), elements=st.floats(-200, 200)), edges)
def test_minimum_image_is_a_whole_number_of_edges_away_and_short(displacement, edge):
    shortest = minimum_image(displacement, edge)
    assert np.all(np.abs(shortest) <= edge / 2 * (1 + 1e-9) + 1e-12)
    boxes = (displacement - shortest) / edge
    np.testing.assert_allclose(boxes, np.rint(boxes), rtol=0, atol=1e-9)


def test_minimum_image_agrees_with_mdanalysis():
    edge = np.array([7.0, 8.5, 14.0])
    displacement = np.random.default_rng(2).uniform(-30, 30, (5000, 3))
    theirs = minimize_vectors(displacement, np.array([*edge, 90, 90, 90]))
    np.testing.assert_allclose(minimum_image(displacement, edge), theirs, atol=1e-5)
