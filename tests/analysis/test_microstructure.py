"""Which phases are ceramics, and the quantities of structures that can be written down."""

import numpy as np
import pytest

from slurrycast.analysis.microstructure import ceramic_phases, microstructure, tortuosities, void_tortuosity
from slurrycast.analysis.quantity_names import tape_quantities
from slurrycast.runtime.files import InputError
from structures import frame, particles

NAMES = ("glue", "A", "B")


def test_a_lattice_of_two_ceramics_with_organics_apart():
    """Columns of A and of B in turns, which touch along z and their neighbours, and organics in two of the gaps."""
    edges_um = np.array([6.0, 6.0, 8.0])
    sites = np.argwhere(np.ones((6, 6, 8))).astype(float)
    position_um = np.concatenate([sites, [[0.5, 0.5, 0.5], [3.5, 3.5, 3.5]]])
    phase = np.append(2 + (sites[:, 0] + sites[:, 1]).astype(int) % 2, [1, 1])
    some = particles(phase, np.append(np.full(len(sites), 0.52), [0.3, 0.3]), NAMES)
    found, image, _ = microstructure(frame(0, position_um, edges_um), some, "glue", 0.5, 0.2)
    value = {name: number for name, (number, _) in found.items()}
    n, volume_um3 = len(sites), 288.0
    cap_um3 = np.pi * 0.02**2 * (3 * 0.52 - 0.02) / 3
    assert value["density"] == pytest.approx(2 * (n + 2) / volume_um3)
    assert value["green_density"] == pytest.approx((2 * n + 2) / volume_um3)
    assert value["share_ceramic_nominal"] == pytest.approx(4 / 3 * np.pi * 0.52**3)
    assert value["share_organic_union"] == pytest.approx(2 * 4 / 3 * np.pi * 0.3**3 / volume_um3)
    for name in ("share_ceramic_union", "share_ceramic_filled"):
        assert value[name] == pytest.approx(4 / 3 * np.pi * 0.52**3 - 6 * cap_um3)
    assert value["share_void_union"] == pytest.approx(1 - value["share_ceramic_union"] - value["share_organic_union"])
    assert value["contacts_ceramic"] == pytest.approx(3)
    assert value["contacts_A-B"] == value["coordination_A-B"] / 2 == pytest.approx(2)
    assert [value[f"percolation_{name}_{axis}"] for name in ("A", "B") for axis in "xyz"] == [0, 0, 1, 0, 0, 1]
    assert [value[f"percolation_ceramic_{axis}"] for axis in "xyz"] == [1, 1, 1]
    assert np.mean(image == 0) == pytest.approx(value["share_void_union"], abs=0.03)
    axes, media = ["x", "z"], ["void", "nonceramic"]
    value |= tortuosities(frame(0, position_um, edges_um), some, "glue", [0.5, 0.4, 0.3], axes, media, True)
    named = {*tape_quantities(NAMES, "glue", [0.5, 0.4, 0.3], axes, media, True)}
    assert named - {*value} == {"shrinkage"}  # which the script adds
    assert {name for name in {*value} - named if "_sd_" not in name} == {"particles", "voxel_spacing"}


@pytest.mark.parametrize(
    ("phase", "names", "said"),
    [
        ([1, 2], ("A", "B"), "organic phase glue: the particles are of A, B"),
        ([1, 1], ("glue", "B"), "organic phase glue: there are no particles of another phase"),
        ([1, 2], ("glue", "void"), "phase void: all, ceramic, nonceramic, organic, void are names of quantities"),
    ],
)
def test_phases_that_are_no_ceramics(phase, names, said):
    with pytest.raises(InputError, match=said):
        ceramic_phases(particles(np.array(phase), 0.4, names), "glue")


def random_spheres(edges_um: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places and phases of some spheres in a box, half of them organic, over its periodic sides too."""
    rng = np.random.default_rng(2)
    return (rng.random((40, 3)) - 0.5) * edges_um, rng.integers(1, 3, 40)


def test_an_axis_in_the_plane_is_that_through_the_thickness_of_the_box_turned():
    edges_um = np.array([1.8, 2.2, 2.7])
    position_um, phase = random_spheres(edges_um)
    some = particles(phase, 0.4, NAMES)
    found = tortuosities(frame(0, position_um, edges_um), some, "glue", [0.2], "xyz")
    assert list(found) == ["tortuosity_x_0.2um", "tortuosity_y_0.2um", "tortuosity_z_0.2um"]
    for last, (name, (factor, unit)) in enumerate(found.items()):
        turned = np.roll(range(3), 2 - last)
        other = frame(0, position_um[:, turned], edges_um[turned])
        expected = void_tortuosity(other, some, 0.2)
        assert (factor, unit) == (pytest.approx(expected, rel=1e-6), "1"), name
        assert expected > 1.05


def test_organics_give_way_to_diffusion_through_all_that_is_no_ceramic():
    """A wall of A whose hole is plugged with glue."""
    edges_um = np.array([2.0, 2.0, 3.0])
    x, y = (places.ravel() for places in np.mgrid[-0.875:1:0.25, -0.875:1:0.25])
    wall_um = np.stack([x, y, np.zeros(len(x))], axis=1)
    hole = np.hypot(x, y) < 0.4
    some = particles(np.where(hole, 1, 2), 0.2, NAMES)
    spacings_um, wall = [0.2, 0.15, 0.1], frame(0, wall_um, edges_um)
    found = tortuosities(wall, some, "glue", spacings_um, "z", ["void", "nonceramic"], with_limit=True)
    grids = ["0.2um", "0.15um", "0.1um", "extrapolated"]
    assert all(np.isnan(found[f"tortuosity_z_{grid}"][0]) for grid in grids)
    ceramic = particles(np.full((~hole).sum(), 2), 0.2, NAMES)
    for spacing_um, grid in zip(spacings_um, grids, strict=False):
        open_hole = void_tortuosity(frame(0, wall_um[~hole], edges_um), ceramic, spacing_um)
        assert found[f"tortuosity_nonceramic_z_{grid}"][0] == open_hole > 1.2
    line = np.polyfit(spacings_um, [found[f"tortuosity_nonceramic_z_{grid}"][0] for grid in grids[:3]], 1)
    assert found["tortuosity_nonceramic_z_extrapolated"][0] == pytest.approx(line[1])
