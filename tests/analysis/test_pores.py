"""Pore sizes: slits and cylinders across the periodic faces, and spheres drawn one by one."""

import numpy as np
import pytest

from slurrycast.analysis.pores import distance_to_solid, local_thickness, pore_sizes

CUBES_UM = np.full(3, 0.1)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("width", [1, 4, 9, 14])
def test_a_slit_across_a_face(axis, width):
    void = np.zeros((18, 18, 18), dtype=bool)
    np.moveaxis(void, axis, 0)[:width] = True
    for shift in (0, -width // 2):
        sizes = pore_sizes(np.roll(void, shift, axis=axis), CUBES_UM)
        assert sizes == pytest.approx(dict.fromkeys(sizes, 0.1 * width), abs=0.0501)
        assert sizes["d10"] == pytest.approx(sizes["d90"])


@pytest.mark.parametrize("centre", [20, 20.5])  # of a voxel, and between four
def test_a_cylinder_across_two_faces(centre):
    x, y = (np.arange(40) - centre)[:, None] * 0.1, (np.arange(40) - centre) * 0.08
    void = np.broadcast_to((np.hypot(x, y) < 1.2)[:, :, None], (40, 40, 6))
    spacing_um = np.array([0.1, 0.08, 0.1])
    sizes = pore_sizes(void, spacing_um)
    assert sizes["mean"] == pytest.approx(2.4, abs=0.17)
    assert pore_sizes(np.roll(void, (20, 20), axis=(0, 1)), spacing_um) == pytest.approx(sizes)


def test_two_slits_are_two_sizes():
    void = np.zeros((4, 4, 60), dtype=bool)
    void[:, :, 5:10], void[:, :, 20:40] = True, True
    sizes = pore_sizes(void, CUBES_UM)
    assert sizes["d10"] == pytest.approx(0.5, abs=0.0501)
    assert sizes["d90"] == pytest.approx(2, abs=0.0501)
    assert sizes["mean"] == pytest.approx((5 * sizes["d10"] + 20 * sizes["d90"]) / 25)


def test_spheres_drawn_one_by_one():
    rng = np.random.default_rng(2)
    shape, spacing_um = np.array([11, 12, 13]), np.array([0.1, 0.11, 0.12])
    void = rng.random(shape) > 0.02
    places = np.argwhere(np.ones(shape))
    apart = places[:, None] - places
    distance_um = np.linalg.norm((apart - shape * np.round(apart / shape)) * spacing_um, axis=2)
    radius_um = np.where(void.ravel(), distance_um[:, ~void.ravel()].min(axis=1), 0)
    np.testing.assert_allclose(distance_to_solid(void, spacing_um).ravel(), radius_um, atol=1e-12)
    largest_um = np.where(distance_um < radius_um * (1 - 1e-9), radius_um, 0).max(axis=1)
    expected_um = np.where(void.ravel(), 2 * largest_um - spacing_um.mean() / 2, 0)
    np.testing.assert_allclose(local_thickness(void, spacing_um).ravel(), expected_um, rtol=1e-6)


@pytest.mark.parametrize("void", [np.zeros((3, 3, 3), dtype=bool), np.ones((3, 3, 3), dtype=bool)])
def test_without_pores_or_walls_there_is_no_size(void):
    assert np.isnan(list(pore_sizes(void, CUBES_UM).values())).all()
