"""Which phases are ceramics, and the quantities of structures that can be written down."""

import numpy as np
import pytest

from slurrycast.analysis.microstructure import ceramic_phases, microstructure
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
