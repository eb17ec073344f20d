"""Voxel images of spheres: lattices, sampled points, overlaps, the file."""

import h5py
import numpy as np
import pytest

from slurrycast.analysis.structure import structure_measures
from slurrycast.analysis.voxels import phase_shares, voxel_image, voxel_shape, write_voxels
from slurrycast.runtime.files import InputError
from structures import particles

EDGES_UM = np.array([5.0, 4.0, 6.0])
LOWER_UM = np.array([-2.0, 1.0, 0.0])


@pytest.mark.parametrize("radius_um", [0.45, 0.5, 0.55, 0.65])
def test_porosity_of_a_simple_cubic_lattice(radius_um):
    position_um = np.argwhere(np.ones((3, 3, 3))).astype(float)
    edges_um = np.full(3, 3.0)
    some = particles(np.ones(len(position_um), dtype=int), radius_um)
    measures = structure_measures(position_um, np.zeros(3), edges_um, some)
    sphere_um3 = 4 / 3 * np.pi * radius_um**3
    # Three lenses a site, each of two caps.
    cap_um = max(0.0, radius_um - 0.5)
    union = sphere_um3 - 6 * np.pi * cap_um**2 * (3 * radius_um - cap_um) / 3
    assert measures["packing_nominal"] == pytest.approx(sphere_um3)
    assert measures["packing_union"] == pytest.approx(union)
    image = voxel_image(position_um, np.zeros(3), edges_um, some.radius_um, some.phase, 0.031)
    assert np.mean(image > 0) == pytest.approx(union, abs=1e-3)


def test_image_of_overlapping_spheres_is_that_of_sampled_points():
    rng = np.random.default_rng(4)
    n = 30
    position_um, radius_um = LOWER_UM + rng.uniform(-1, 2, (n, 3)) * EDGES_UM, rng.uniform(0.6, 1.1, n)
    code = rng.integers(1, 4, n)
    image = voxel_image(position_um, LOWER_UM, EDGES_UM, radius_um, code, 0.05)
    # One random point in each cell of a grid that is not the one of the voxels.
    cells = (62, 54, 78)
    points = LOWER_UM + (np.argwhere(np.ones(cells)) + rng.random((np.prod(cells), 3))) / cells * EDGES_UM
    height_um, owner = np.zeros(len(points)), np.zeros(len(points), dtype=int)
    for centre_um, radius, phase in zip(position_um, radius_um, code, strict=True):
        difference_um = points - centre_um
        difference_um -= EDGES_UM * np.round(difference_um / EDGES_UM)
        height = np.sqrt(np.einsum("ij,ij->i", difference_um, difference_um)) - radius
        owner[height < height_um] = phase
        np.minimum(height_um, height, out=height_um)
    for phase in range(4):
        assert np.mean(image == phase) == pytest.approx(np.mean(owner == phase), abs=1e-3)
    assert 0.1 < np.mean(image == 0) < 0.5


def test_every_voxel_is_that_of_its_centre():
    rng = np.random.default_rng(5)
    position_um, radius_um, code = rng.random((9, 3)) * EDGES_UM, rng.uniform(0.3, 1.5, 9), np.arange(1, 10)
    image = voxel_image(position_um, np.zeros(3), EDGES_UM, radius_um, code, 0.4)
    centres_um = (np.argwhere(np.ones(image.shape)) + 0.5) * EDGES_UM / image.shape
    difference_um = centres_um[:, None] - position_um
    difference_um -= EDGES_UM * np.round(difference_um / EDGES_UM)
    height_um = np.linalg.norm(difference_um, axis=2) - radius_um
    expected = np.where(height_um.min(axis=1) < 0, code[height_um.argmin(axis=1)], 0)
    np.testing.assert_array_equal(image.ravel(), expected)


def test_whole_voxels_fill_the_box():
    assert voxel_shape(np.array([1.0, 1.06, 0.01]), 0.1) == (10, 11, 1)
    with pytest.raises(InputError, match=r"voxels of 0.01 um: 1000000000 in the box, at most 50000000 are allowed"):
        voxel_shape(np.array([10.0, 10.0, 10.0]), 0.01)


def test_codes_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="voxel codes 0 to 0: must be 1 to 255"):
        voxel_image(np.zeros((1, 3)), np.zeros(3), EDGES_UM, np.ones(1), np.zeros(1, dtype=int), 0.5)


def test_image_file_and_shares_along_z(tmp_path):
    image = np.zeros((2, 3, 4), dtype=np.uint8)
    image[:, :, 1], image[0, 0, 2] = 2, 1
    write_voxels(tmp_path / "image.h5", image, np.array([1.0, 1.5, 2.4]), ("A", "B"))
    with h5py.File(tmp_path / "image.h5") as file:
        np.testing.assert_array_equal(file["phase"], image)
        np.testing.assert_allclose(file["phase"].attrs["spacing_um"], [0.5, 0.5, 0.6])
        assert list(file["phase"].attrs["codes"]) == ["void", "A", "B"]
        assert list(file["phase"].attrs["axes"]) == ["x", "y", "z"]
    np.testing.assert_allclose(phase_shares(image, 2), [[1, 0, 5 / 6, 1], [0, 0, 1 / 6, 0], [0, 1, 0, 0]])
