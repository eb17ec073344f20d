"""What the network is asked for: windows of input frames, and places on the way to the end."""

import numpy as np
import pytest
from slurries import EDGES_UM, SETTINGS, random_network, trajectory

from slurrycast.runtime.files import InputError
from slurrycast.surrogates.neighbours import Neighbours
from slurrycast.surrogates.neighbours.network import by_layer, tensors
from slurrycast.surrogates.neighbours.targets import layer_shares, make_example, needed_frames, stages, windows


def test_windows_of_input_frames_lie_in_the_run():
    assert windows([7, 8, 9, 10], 2) == [[5, 6, 7, 8], [6, 7, 8, 9], [7, 8, 9, 10]]
    assert windows([1, 2, 3], 2) == [[0, 1, 2], [1, 2, 3]]


def test_first_frame_seen_is_the_end_of_the_earliest_window():
    assert Neighbours().first_frame_seen([7, 8, 9, 10], {"earlier_frames": 0}) == 10
    assert Neighbours().first_frame_seen([7, 8, 9, 10], {"earlier_frames": 7}) == 3
    assert Neighbours().first_frame_seen([7, 8, 9, 10], {"earlier_frames": 20}) == 3
    assert Neighbours().first_frame_seen([2, 6, 10], {"earlier_frames": 7}) == 8


def shrinking(*log_volumes: float) -> dict[int, np.ndarray]:
    """Edges of a box with these logarithms of the volume at frames 0, 1 and so on."""
    return {k: np.full(3, np.exp(value / 3)) for k, value in enumerate(log_volumes)}


def test_intermediate_targets_are_shares_of_the_way_of_the_volume():
    # from frame 1 on 3 to go, of which 1, 1.9, 2.1, 3, 2.8 and 3 are gone
    edges_um = shrinking(5, 4, 3, 2.1, 1.9, 1, 1.2, 1)
    settings = {"target_frame": 7, "intermediate_targets": [0.3, 0.65, 0.95]}

    def reached(last_frame):
        return [
            (stage.before, stage.after, pytest.approx(stage.part)) for stage in stages(edges_um, last_frame, settings)
        ]

    end = (7, 7, 1.0)
    assert reached(1) == [(1, 2, 0.9), (3, 4, 0.25), (4, 5, 0.25 / 0.3), end]
    assert reached(6) == [(6, 7, 0.3), (6, 7, 0.65), (6, 7, 0.95), end]
    edges_um = dict.fromkeys(range(8), np.ones(3))  # nothing to go
    assert reached(1) == [(1, 2, 0.3), (1, 2, 0.65), (1, 2, 0.95), end]


def test_frames_that_are_read_are_those_that_are_needed():
    edges_um = shrinking(*np.linspace(1, 0, 101))
    settings = {**SETTINGS, "input_frames": [8, 10], "target_frame": 100, "intermediate_targets": [0.5], "layers": 3}
    assert needed_frames(settings, edges_um) == [7, 8, 9, 10, 54, 55, 100]
    assert needed_frames(settings, edges_um, moved=False) == [8, 10, 54, 55, 100]
    with pytest.raises(InputError, match="frame 101 is not among the frames 0 to 100"):
        needed_frames({**settings, "target_frame": 101}, edges_um)


def test_layers_are_asked_for_where_particles_are_on_the_way():
    """The last estimate is the answer, and the targets are places in the final box."""
    seen = trajectory("T1", 1)
    example = make_example(seen, [8, 9, 10], SETTINGS)
    assert example.moved.shape == (2, 60, 3)
    scaled = {number: frame.position_um / frame.edges_um for number, frame in seen.frames.items()}
    log_volume = {number: np.log(edges_um).sum() for number, edges_um in seen.edges_um.items()}
    part = 0.08 * (log_volume[120] - log_volume[10]) / (log_volume[11] - log_volume[10])
    assert 0.2 < part < 1
    for moved_um, there in zip(
        example.moved * example.diameter_um, ((1 - part) * scaled[10] + part * scaled[11], scaled[120]), strict=True
    ):
        expected = there * EDGES_UM - example.graph.affine_um
        np.testing.assert_allclose(moved_um, expected - expected.mean(axis=0), atol=1e-6)
    network = random_network()
    inputs = tensors(example.graph)
    moved_um, log_variance = network(inputs)
    both_um, same = by_layer(network, 2)(inputs)
    np.testing.assert_allclose(both_um[-1], moved_um, atol=1e-6)
    np.testing.assert_allclose(same, log_variance, atol=1e-6)
    assert np.abs(both_um[0] - both_um[1]).max() > 1e-3


def test_each_layer_stands_for_a_share_of_the_way():
    settings = {"intermediate_targets": [0.2, 0.6]}
    assert layer_shares({**settings, "layers": 3}) == [0.2, 0.6, 1.0]
    assert layer_shares({**settings, "layers": 5}) == [0.2, 0.2, 0.2, 0.6, 1.0]
    assert layer_shares({"intermediate_targets": [], "layers": 2}) == [1.0, 1.0]
