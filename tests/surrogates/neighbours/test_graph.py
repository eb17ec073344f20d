"""Pairs of neighbours across the periodic faces."""

import itertools

import numpy as np
import pytest
from MDAnalysis.lib.distances import self_capped_distance
from slurries import EDGES_UM, answer, particles_of, slurry

from slurrycast.data.neighbour_search import neighbour_pairs
from slurrycast.data.periodic import minimum_image
from slurrycast.runtime.files import InputError
from slurrycast.surrogates.neighbours.graph import checked_pairs, mean_diameter_um


@pytest.mark.parametrize("cutoff_um", [0.9, 1.6, 2.1])  # up to half the shortest edge
def test_pairs_are_those_of_all_images(cutoff_um):
    position_um = np.random.default_rng(3).uniform(-20, 20, (50, 3))
    receivers, senders, separation_um = neighbour_pairs(position_um, EDGES_UM, cutoff_um)
    expected = {}
    for i, j in itertools.permutations(range(50), 2):
        apart_um = minimum_image(position_um[j] - position_um[i], EDGES_UM)
        if np.linalg.norm(apart_um) < cutoff_um:
            expected[i, j] = apart_um
    assert list(zip(receivers.tolist(), senders.tolist(), strict=True)) == sorted(expected)
    np.testing.assert_allclose(separation_um, [expected[pair] for pair in sorted(expected)], atol=1e-12)


def test_pairs_agree_with_mdanalysis():
    position_um = np.random.default_rng(4).uniform(0, 8, (2000, 3))
    box = np.array([8.0, 8, 8, 90, 90, 90])
    pairs = self_capped_distance(position_um, 1.6, box=box, return_distances=False)
    receivers, senders, _ = neighbour_pairs(position_um, box[:3], 1.6)
    assert set(zip(receivers.tolist(), senders.tolist(), strict=True)) == {*map(tuple, [*pairs, *pairs[:, ::-1]])}


def test_pairs_are_decided_in_float64():
    """Distances that differ from the cutoff by less than float32 tells apart."""
    place_um = np.array([[0.0, 0, 0], [1.6 - 1e-9, 0, 0], [0, 1.6 + 1e-9, 0]])
    receivers, senders, _ = neighbour_pairs(place_um, EDGES_UM, 1.6)
    assert list(zip(receivers, senders, strict=True)) == [(0, 1), (1, 0)]


def test_particle_on_the_face_of_the_box():
    position_um = np.array([[-1e-17, 0.0, 0.0], [4.2, 0.5, 0.0]])
    receivers, _, separation_um = neighbour_pairs(position_um, EDGES_UM, 1.6)
    assert receivers.tolist() == [0, 1]
    np.testing.assert_allclose(separation_um, [[0, 0.5, 0], [0, -0.5, 0]], atol=1e-12)


def test_cutoff_beyond_half_the_box_is_refused(model):
    history, edges_um = slurry()
    with pytest.raises(InputError) as error:
        answer(model, history, edges_um, np.array([4.2, 3.1, 6.3]), cutoff_diameters=1.5)  # that of the model counts, 2
    half = 1.55 / mean_diameter_um(particles_of(history))
    assert str(error.value) == (
        f"surrogate.neighbours.cutoff_diameters = 2: must be at most {half:.4g}, half the shortest edge of the final "
        "box"
    )


def test_cutoff_without_neighbours_is_refused():
    place_um = np.array([[0.0, 0, 0], [1, 1, 1]])
    with pytest.raises(InputError, match=r"cutoff_diameters = 0\.5: must be above the distance of the closest"):
        checked_pairs(place_um, EDGES_UM, 0.5)
