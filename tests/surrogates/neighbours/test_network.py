"""The network: equivariance, the stored ensemble, and gaps in the box of the time."""

import keras
import numpy as np
import pytest
from slurries import EDGES_UM, answer, frames_of, particles_of, slurry

from slurrycast.data.neighbour_search import neighbour_pairs
from slurrycast.report.network_table import read_network
from slurrycast.surrogates import neighbours
from slurrycast.surrogates.neighbours import answers
from slurrycast.surrogates.neighbours.graph import INPUTS, mean_diameter_um, slurry_graph
from slurrycast.surrogates.neighbours.network import DISTANCES, Interaction, build, joined, tensors


@pytest.mark.parametrize("n_members", [1, 3])
def test_stored_members_answer_as_the_networks_that_they_were(tmp_path, n_members):
    shape = {"n_scalars": 11, "n_past": 2, "shares": [0.4, 0.4, 0.8, 1.0], "width": 8, "n_vectors": 4, "cutoff": 2.0}
    network = build(**shape, name="net")
    draw = np.random.default_rng(6)
    members = [
        [draw.normal(0, 0.3, variable.shape) for variable in network.trainable_variables] for _ in range(n_members)
    ]
    history, edges_um = slurry()
    seen = slurry_graph(particles_of(history), frames_of(history, edges_um), EDGES_UM, 2.0)
    inputs = tensors(seen)
    joined(shape, members).save(tmp_path / "model.keras")
    loaded = keras.saving.load_model(tmp_path / "model.keras", safe_mode=True)
    together = loaded(inputs)
    each = answers(loaded.get_layer("ensemble"), seen)
    for number, weights in enumerate(members):
        for variable, value in zip(network.trainable_variables, weights, strict=True):
            variable.assign(value)
        for expected, *actual in zip(network(inputs), together, each, strict=True):
            assert np.std(expected) > 1e-3
            for one in actual:
                np.testing.assert_allclose(one[:, number], expected, atol=1e-5)


@pytest.fixture(scope="module")
def asked(model):
    """A slurry, its edges, and positions and spreads that the network answers."""
    return *slurry(), *answer(model, *slurry())


def test_answer_is_not_the_affine_map(asked):
    history, edges_um, position_um, _ = asked
    moved_um = position_um - history[:, -1, 2:5] / edges_um[-1] * EDGES_UM
    assert np.sqrt(np.mean(moved_um**2)) > 0.01  # what the tests below say would else be empty


def test_order_of_the_particles_does_not_matter(model, asked):
    history, edges_um, *expected = asked
    order = np.random.default_rng(7).permutation(len(history))
    for one, other in zip(expected, answer(model, history[order], edges_um), strict=True):
        np.testing.assert_allclose(other, one[order], atol=1e-5)


@pytest.mark.parametrize(
    ("shifted", "shift"), [(slice(None), (0.31, -0.77, 2.2)), (5, (1, -2, 0))], ids=["all", "one image"]
)
def test_shift_of_particles_shifts_their_answer(model, asked, shifted, shift):
    """By edges of the box of each frame: of all, as its origin has no meaning, or of one to any of its images."""
    history, edges_um, position_um, spread_um = asked
    other, expected_um = history.copy(), position_um.copy()
    other[shifted, :, 2:5] += edges_um * shift
    expected_um[shifted] += EDGES_UM * shift
    moved_um, moved_spread_um = answer(model, other, edges_um)
    np.testing.assert_allclose(moved_um, expected_um, atol=1e-5)
    np.testing.assert_allclose(moved_spread_um, spread_um, atol=1e-5)


@pytest.mark.parametrize(
    ("axes", "signs"),
    [((0, 1, 2), (-1, -1, -1)), ((1, 2, 0), (1, 1, 1)), ((0, 2, 1), (1, -1, 1)), ((2, 1, 0), (1, 1, 1))],
)
def test_turned_and_mirrored_slurry_gets_the_answer_turned_and_mirrored(model, asked, axes, signs):
    history, edges_um, position_um, spread_um = asked
    turned = history.copy()
    turned[..., 2:5] = history[..., 2:5][..., axes] * signs
    other_um, other_spread_um = answer(model, turned, edges_um[:, axes], EDGES_UM[list(axes)])
    np.testing.assert_allclose(other_um, position_um[:, axes] * signs, atol=1e-5)
    np.testing.assert_allclose(other_spread_um, spread_um[:, axes], atol=1e-5)


def test_slurry_repeated_in_space_gets_the_same_answer_in_each_copy(model, asked):
    """A box twice as long with everything twice in it is the same slurry: size does not matter."""
    history, edges_um, position_um, spread_um = asked
    copies = np.concatenate([history, history])
    half = np.array([0, 0, 0.5])
    copies[: len(history), :, 2:5] -= half * edges_um
    copies[len(history) :, :, 2:5] += half * edges_um
    long = np.array([1, 1, 2])
    both_um, both_spread_um = answer(model, copies, edges_um * long, EDGES_UM * long)
    # the volume ratio, and with it all else, is the same
    for part, shift in ((slice(None, len(history)), -half), (slice(len(history), None), half)):
        np.testing.assert_allclose(both_um[part], position_um + shift * EDGES_UM, atol=1e-5)
        np.testing.assert_allclose(both_spread_um[part], spread_um, atol=1e-5)


def test_neighbours_come_and_go_without_a_jump(model):
    """A particle that crosses the cutoff of another changes nothing at once."""
    history, edges_um = slurry()
    cutoff_um = 2.0 * mean_diameter_um(particles_of(history))
    affine_um = history[:, -1, 2:5] / edges_um[-1] * EDGES_UM
    receivers, senders, separation_um = neighbour_pairs(affine_um, EDGES_UM, cutoff_um)
    distance_um = np.linalg.norm(separation_um, axis=1)
    edge = int(np.argmax(distance_um))
    direction = separation_um[edge] / distance_um[edge]
    answers = []
    for distance in (cutoff_um - 1e-6, cutoff_um + 1e-6):
        moved = history.copy()
        moved[senders[edge], :, 2:5] += direction * (distance - distance_um[edge]) / EDGES_UM * edges_um
        answers.append(answer(model, moved, edges_um)[0][receivers[edge]])
    np.testing.assert_allclose(*answers, atol=1e-3)


@pytest.mark.parametrize("factor", [0.1, 3.7])
def test_powder_that_is_coarser_by_a_factor_moves_farther_by_it(model, asked, factor):
    history, edges_um, position_um, spread_um = asked
    coarse = history.copy()
    coarse[..., 1:5] *= factor
    coarse_um, coarse_spread_um = answer(model, coarse, factor * edges_um, factor * EDGES_UM)
    np.testing.assert_allclose(coarse_um / factor, position_um, atol=1e-5)
    np.testing.assert_allclose(coarse_spread_um / factor, spread_um, rtol=1e-5)


@pytest.mark.parametrize(("share", "scale"), [(0.0, 1.2), (0.5, np.sqrt(1.2))])
def test_gap_is_that_in_the_box_of_the_time(share, scale):
    """Two that touch in a box `scale` times as wide as the final one get the answer of two that touch there."""
    layer = Interaction(8, 4, 1.6, share)
    layer.build()
    rng = np.random.default_rng(0)
    for weights in layer.weights:
        weights.assign(rng.normal(0, 0.3, weights.shape))
    n_distances = len(DISTANCES)
    seen = layer.of_places.kernel.numpy()
    seen[:n_distances] = seen[-3:-1] = 0  # deaf to the distance itself
    layer.of_places.kernel.assign(seen)
    left = np.full(2, -3 * np.log(1.2), dtype=np.float32)
    state, vectors, moved = np.ones((2, 8), "f4"), np.zeros((2, 3, 4), "f4"), np.zeros((2, 3), "f4")

    def answer(distance, radius, left):
        apart = np.array([[distance, 0, 0], [-distance, 0, 0]], "f4")
        layer.cutoff = 1.6 * distance  # whose envelope would tell the distance
        radii = np.full(2, radius, "f4")
        pairs = np.array([0, 1], "i4"), np.array([1, 0], "i4")
        return layer.call(state, vectors, moved, radii, left, *pairs, apart)[0].numpy()

    touching = answer(0.8 / scale, 0.4, left)
    np.testing.assert_allclose(touching, answer(0.8, 0.4, np.zeros(2, "f4")), atol=1e-4)
    assert np.abs(touching - answer(0.75 / scale, 0.4, left)).max() > 1e-3


def test_compiled_prediction_is_the_same(model, asked, monkeypatch):
    monkeypatch.setattr(neighbours, "COMPILED_FROM", 0)
    for one, other in zip(answer(model, *slurry()), asked[2:], strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5)


def test_report_describes_the_ensemble(model):
    network = read_network(model)
    assert [layer.name for layer in network.layers[:-1]] == [f"Input {name}" for name in INPUTS]
    ensemble = network.layers[-1]
    assert ensemble.name == "Ensemble of 2 networks, 2 layers of width 8"
    assert ensemble.parameters == network.parameters
    one = build(11, 2, [0.08, 1.0], 8, 4, 1.6, "net")
    assert network.parameters == 2 * one.count_params()
