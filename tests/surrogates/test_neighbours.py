"""Message passing: neighbours across the periodic faces, the same answer however a slurry is put, resumed training."""

import itertools
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slurrycast.data.frames import Frame, Particles
from slurrycast.data.periodic import minimum_image, to_scaled
from slurrycast.data.trajectories import Trajectory
from slurrycast.report.network_table import read_network
from slurrycast.runtime.files import InputError
from slurrycast.surrogates import neighbours
from slurrycast.surrogates.prediction import PredictionInput

SETTINGS = {
    "members": 2,
    "epochs": 3,
    "learning_rate": 5e-2,
    "weight_decay": 1e-2,
    "layers": 2,
    "width": 8,
    "vectors": 4,
    "cutoff_um": 1.6,
    "earlier_frames": 1,
    "intermediate_targets": [0.08],  # at the next frame
    "input_frames": [8, 9, 10],
    "target_frame": 120,
    "threads": 1,
    "seed": 5,
}
EDGES_UM = np.array([4.2, 4.2, 6.3])
SHRINKAGE = (1.3, 1.25, 1.22)  # of the edges at three input frames
PHASES = ("BDPD", "NiO", "8YSZ")


def slurry(n=60, seed=0) -> tuple[np.ndarray, np.ndarray]:
    """Features (n, 3, 6) of particles that drift while their box shrinks, and edges (3, 3)."""
    rng = np.random.default_rng(seed)
    scaled = rng.uniform(-0.5, 0.5, (n, 3)) + np.cumsum(rng.normal(0, 0.01, (3, n, 3)), axis=0)
    edges_um = np.array(SHRINKAGE)[:, None] * EDGES_UM
    static = np.column_stack([rng.integers(1, 4, n), rng.uniform(0.25, 0.55, n)])
    frames = [
        np.column_stack([static, place * edge_um, rng.integers(0, 9, n)])
        for place, edge_um in zip(scaled, edges_um, strict=True)
    ]
    return np.stack(frames, axis=1), edges_um


def particles_of(history: np.ndarray) -> Particles:
    n, phase = len(history), history[:, 0, 0].astype(int)
    return Particles(np.arange(1, n + 1), phase, phase, np.ones(n, int), history[:, 0, 1], np.ones(n), PHASES)


def frame(number: int, place_um: np.ndarray, contacts: np.ndarray, edges_um: np.ndarray) -> Frame:
    scaled = to_scaled(place_um, -edges_um / 2, edges_um)
    return Frame(number, 500 * number, 1.0 * number, place_um, scaled, contacts.astype(int), -edges_um / 2, edges_um)


def frames_of(history: np.ndarray, edges_um: np.ndarray, first: int = 8) -> tuple[Frame, ...]:
    return tuple(frame(first + k, history[:, k, 2:5], history[:, k, 5], edges_um[k]) for k in range(history.shape[1]))


def trajectory(name: str, seed: int) -> Trajectory:
    """A slurry whose particles drift for five frames, and then go back to where they came from, and farther."""
    rng = np.random.default_rng(seed)
    drift = rng.normal(0, 0.01, (60, 1, 3)) * np.arange(5)[:, None]
    scaled = rng.uniform(-0.5, 0.5, (60, 1, 3)) + drift
    edges_um = np.array([1.35, *SHRINKAGE, 1.2])[:, None] * EDGES_UM
    static = np.broadcast_to(
        np.column_stack([rng.integers(1, 4, 60), rng.uniform(0.25, 0.55, 60)])[:, None], (60, 5, 2)
    )
    history = np.concatenate([static, scaled * edges_um, rng.integers(0, 9, (60, 5, 1))], axis=2)
    end = frame(120, (scaled[:, 0] - drift[:, -1]) * EDGES_UM, history[:, 0, 5], EDGES_UM)
    frames = {f.number: f for f in (*frames_of(history, edges_um, 7), end)}
    known_um = {k: frames[k].edges_um if k in frames else EDGES_UM for k in range(7, 121)}
    return Trajectory(name, particles_of(history), frames, known_um)


def fit(settings: dict, folder: Path, validation=("V1",)) -> dict[str, float]:
    slurries = [trajectory(name, seed) for seed, name in enumerate(("T1", "T2"), start=1)]
    places = folder / "model.keras", folder / "history.csv", folder / "work"
    return neighbours.fit(slurries, [trajectory(name, 3) for name in validation], settings, *places)


def prediction_input(
    history: np.ndarray, edges_um: np.ndarray, final_edges_um: np.ndarray = EDGES_UM
) -> PredictionInput:
    return PredictionInput("1", particles_of(history), frames_of(history, edges_um), final_edges_um)


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trained")
    fit(SETTINGS, folder)
    return folder / "model.keras"


def answer(model, *asked, **settings):
    prediction = neighbours.predict(prediction_input(*asked), model, {**SETTINGS, **settings})
    return prediction.position_um, prediction.spread_um


def test_pairs_are_those_of_all_images(model):
    rng = np.random.default_rng(3)
    position_um = rng.uniform(-20, 20, (50, 3))
    receivers, senders, separation_um = neighbours.neighbour_pairs(position_um, EDGES_UM, 1.6)
    expected = {}
    for i, j in itertools.permutations(range(50), 2):
        apart_um = minimum_image(position_um[j] - position_um[i], EDGES_UM)
        if np.linalg.norm(apart_um) < 1.6:
            expected[i, j] = apart_um
    assert list(zip(receivers.tolist(), senders.tolist(), strict=True)) == sorted(expected)
    np.testing.assert_allclose(separation_um, [expected[pair] for pair in sorted(expected)], atol=1e-12)


def test_pairs_agree_with_freud():
    import freud

    position_um = np.random.default_rng(4).uniform(-0.5, 0.5, (200, 3)) * 8
    box = freud.box.Box.cube(8)
    found = freud.locality.AABBQuery(box, position_um).query(position_um, {"r_max": 1.6, "exclude_ii": True})
    pairs = {(int(i), int(j)) for i, j in found.toNeighborList()[:]}
    receivers, senders, _ = neighbours.neighbour_pairs(position_um, np.full(3, 8.0), 1.6)
    assert set(zip(receivers.tolist(), senders.tolist(), strict=True)) == pairs


def test_particle_on_the_face_of_the_box():
    position_um = np.array([[-1e-17, 0.0, 0.0], [4.2, 0.5, 0.0]])
    receivers, _, separation_um = neighbours.neighbour_pairs(position_um, EDGES_UM, 1.6)
    assert receivers.tolist() == [0, 1]
    np.testing.assert_allclose(separation_um, [[0, 0.5, 0], [0, -0.5, 0]], atol=1e-12)


def test_cutoff_beyond_half_the_box_is_refused(model):
    history, edges_um = slurry()
    with pytest.raises(InputError) as error:
        answer(model, history, edges_um, np.array([4.2, 3.1, 6.3]), cutoff_um=1.5)  # the model's own, 1.6, counts
    assert str(error.value) == (
        "surrogate.neighbours.cutoff_um = 1.6: must be at most 1.55, half the shortest edge of the final box"
    )


def test_cutoff_without_neighbours_is_refused():
    place_um = np.array([[0.0, 0, 0], [1, 1, 1]])
    with pytest.raises(InputError, match=r"cutoff_um = 0\.5: must be above the distance of the closest particles"):
        neighbours.neighbour_pairs(place_um, EDGES_UM, 0.5)


def test_untrained_network_is_the_affine_map(tmp_path, monkeypatch):
    """Before the first step, so a training that learns nothing does no harm."""
    monkeypatch.setattr(neighbours, "learning_rate_share", lambda share: 0.0)
    settings = {**SETTINGS, "weight_decay": 0.0, "epochs": 1}
    fit(settings, tmp_path)
    history, edges_um = slurry()
    position_um, spread_um = answer(tmp_path / "model.keras", history, edges_um)
    np.testing.assert_allclose(position_um, history[:, -1, 2:5] / edges_um[-1] * EDGES_UM, atol=1e-6)
    np.testing.assert_allclose(spread_um, np.exp(-2.5 / 2), rtol=1e-5)


@pytest.mark.parametrize("n_members", [1, 3])
def test_stored_members_answer_as_the_networks_that_they_were(tmp_path, n_members):
    from slurrycast.surrogates import neighbour_network, start_keras

    start_keras()
    import keras

    shape = {"n_scalars": 11, "n_past": 2, "shares": [0.4, 0.4, 0.8, 1.0], "width": 8, "n_vectors": 4, "cutoff_um": 1.6}
    network = neighbour_network.build(**shape, name="net")
    draw = np.random.default_rng(6)
    members = [
        [draw.normal(0, 0.3, variable.shape) for variable in network.trainable_variables] for _ in range(n_members)
    ]
    history, edges_um = slurry()
    seen = neighbours.graph(particles_of(history), frames_of(history, edges_um), EDGES_UM, 1.6)
    inputs = [getattr(seen, name) for name in neighbours.INPUTS]
    neighbour_network.joined(shape, members).save(tmp_path / "model.keras")
    loaded = keras.saving.load_model(tmp_path / "model.keras", safe_mode=True)
    together = loaded(inputs)
    answers = neighbours._answers(loaded.get_layer("ensemble"), seen)
    for number, weights in enumerate(members):
        for variable, value in zip(network.trainable_variables, weights, strict=True):
            variable.assign(value)
        for expected, *found in zip(network(inputs), together, answers, strict=True):
            assert np.std(expected) > 1e-3
            for one in found:
                np.testing.assert_allclose(one[:, number], expected, atol=1e-5)


@pytest.mark.parametrize(("log_variance", "spread_um"), [(40.0, 1.0), (1000.0, 1.0), (-40.0, 0.01), (-4.0, np.exp(-2))])
def test_spread_of_a_member_is_between_what_can_be_known_and_a_diameter(model, monkeypatch, log_variance, spread_um):
    def answers(_, seen):
        moved_um = np.zeros((len(seen.radius_um), 2, 3))
        return moved_um, np.full((len(moved_um), 2, 1), log_variance)

    monkeypatch.setattr(neighbours, "_answers", answers)
    np.testing.assert_allclose(answer(model, *slurry())[1], spread_um)


@pytest.mark.parametrize(("moved_um", "found_um"), [((0, 0.3, 0.4), (0, 0.3, 0.4)), ((0, 24, -32), (0, 1.2, -1.6))])
def test_no_member_moves_a_particle_farther_than_any_went(model, monkeypatch, moved_um, found_um):
    def answers(_, seen):
        every = np.broadcast_to(np.array(moved_um, float), (len(seen.radius_um), 2, 3))
        return every, np.full((len(every), 2, 1), -4.0)

    monkeypatch.setattr(neighbours, "_answers", answers)
    history, edges_um = slurry()
    affine_um = history[:, -1, 2:5] / edges_um[-1] * EDGES_UM
    np.testing.assert_allclose(answer(model, history, edges_um)[0] - affine_um, [found_um] * 60, atol=1e-12)


def test_answer_is_not_the_affine_map(model):
    history, edges_um = slurry()
    moved_um = answer(model, history, edges_um)[0] - history[:, -1, 2:5] / edges_um[-1] * EDGES_UM
    assert np.sqrt(np.mean(moved_um**2)) > 0.01  # what the tests below say would else be empty


def test_order_of_the_particles_does_not_matter(model):
    history, edges_um = slurry()
    order = np.random.default_rng(7).permutation(len(history))
    for one, other in zip(answer(model, history, edges_um), answer(model, history[order], edges_um), strict=True):
        np.testing.assert_allclose(other, one[order], atol=1e-5)


def test_shift_of_all_particles_shifts_the_answer(model):
    """By different lengths in each frame's own box: the origin of the box has no meaning."""
    history, edges_um = slurry()
    shifted = history.copy()
    scaled = np.array([0.31, -0.77, 2.2])
    shifted[..., 2:5] += scaled * edges_um
    position_um, spread_um = answer(model, history, edges_um)
    moved_um, moved_spread_um = answer(model, shifted, edges_um)
    np.testing.assert_allclose(moved_um, position_um + scaled * EDGES_UM, atol=1e-5)
    np.testing.assert_allclose(moved_spread_um, spread_um, atol=1e-5)


def test_particle_may_be_given_by_any_of_its_images(model):
    history, edges_um = slurry()
    other = history.copy()
    other[5, :, 2:5] += edges_um * np.array([1, -2, 0])
    position_um, moved_um = answer(model, history, edges_um)[0], answer(model, other, edges_um)[0]
    expected = position_um.copy()
    expected[5] += EDGES_UM * np.array([1, -2, 0])
    np.testing.assert_allclose(moved_um, expected, atol=1e-5)


@pytest.mark.parametrize(
    ("axes", "signs"),
    [((0, 1, 2), (-1, -1, -1)), ((1, 2, 0), (1, 1, 1)), ((0, 2, 1), (1, -1, 1)), ((2, 1, 0), (1, 1, 1))],
)
def test_turned_and_mirrored_slurry_gets_the_answer_turned_and_mirrored(model, axes, signs):
    history, edges_um = slurry()
    turned = history.copy()
    turned[..., 2:5] = history[..., 2:5][..., axes] * signs
    position_um, spread_um = answer(model, history, edges_um)
    other_um, other_spread_um = answer(model, turned, edges_um[:, axes], EDGES_UM[list(axes)])
    np.testing.assert_allclose(other_um, position_um[:, axes] * signs, atol=1e-5)
    np.testing.assert_allclose(other_spread_um, spread_um[:, axes], atol=1e-5)


def test_slurry_repeated_in_space_gets_the_same_answer_in_each_copy(model):
    """A box twice as long with everything twice in it is the same slurry: size does not matter."""
    history, edges_um = slurry()
    copies = np.concatenate([history, history])
    half = np.array([0, 0, 0.5])
    copies[: len(history), :, 2:5] -= half * edges_um
    copies[len(history) :, :, 2:5] += half * edges_um
    long = np.array([1, 1, 2])
    position_um, spread_um = answer(model, history, edges_um)
    both_um, both_spread_um = answer(model, copies, edges_um * long, EDGES_UM * long)
    # the volume ratio, and with it all else, is the same
    for part, shift in ((slice(None, len(history)), -half), (slice(len(history), None), half)):
        np.testing.assert_allclose(both_um[part], position_um + shift * EDGES_UM, atol=1e-5)
        np.testing.assert_allclose(both_spread_um[part], spread_um, atol=1e-5)


def test_neighbours_come_and_go_without_a_jump(model):
    """A particle that crosses the cutoff of another changes nothing at once."""
    history, edges_um = slurry()
    receivers, senders, separation_um = neighbours.neighbour_pairs(
        history[:, -1, 2:5] / edges_um[-1] * EDGES_UM, EDGES_UM, 1.6
    )
    distance_um = np.linalg.norm(separation_um, axis=1)
    edge = int(np.argmax(distance_um))
    direction = separation_um[edge] / distance_um[edge]
    answers = []
    for distance in (1.6 - 1e-6, 1.6 + 1e-6):
        moved = history.copy()
        moved[senders[edge], :, 2:5] += direction * (distance - distance_um[edge]) / EDGES_UM * edges_um
        answers.append(answer(model, moved, edges_um)[0][receivers[edge]])
    np.testing.assert_allclose(*answers, atol=1e-3)


def test_training_learns(tmp_path):
    settings = {**SETTINGS, "members": 1, "epochs": 60}
    fit(settings, tmp_path)
    loss = [float(line.split(",")[1]) for line in (tmp_path / "history.csv").read_text().splitlines()[1:]]
    assert len(loss) == 60
    assert loss[-1] < 0.5 * loss[0]


@pytest.mark.parametrize("member", [1, 2])
def test_killed_training_ends_like_an_undisturbed_one(model, tmp_path, monkeypatch, capsys, member):
    shares, learning_rate_share = [], neighbours.learning_rate_share

    def dies(share):
        shares.append(share)
        if len(shares) == 6 * (member - 1) + 5:  # in the last of three epochs of two slurries
            raise KeyboardInterrupt
        return learning_rate_share(share)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(neighbours, "learning_rate_share", dies)
        fit(SETTINGS, tmp_path)
    capsys.readouterr()
    spent = fit(SETTINGS, tmp_path)
    assert f"[neighbours {member}] resuming after epoch 2" in capsys.readouterr().out
    assert (tmp_path / "history.csv").read_text() == (model.parent / "history.csv").read_text()
    for one, other in zip(answer(tmp_path / "model.keras", *slurry()), answer(model, *slurry()), strict=True):
        np.testing.assert_array_equal(one, other)
    assert spent["cpu_s"] > 0


def test_learning_rate_rises_and_falls():
    shares = np.linspace(0, 1, 101)
    rates = [neighbours.learning_rate_share(share) for share in shares]
    assert rates[0] == 0
    assert max(rates) == pytest.approx(1) and rates.index(max(rates)) == 15
    assert rates[-1] == pytest.approx(0)


def test_models_that_do_not_fit_are_refused(model, tmp_path):
    (tmp_path / "model.keras").write_text("no model")
    with pytest.raises(InputError, match=r"model\.keras: not a readable Keras model"):
        answer(tmp_path / "model.keras", *slurry())
    from slurrycast.surrogates import neighbour_network

    neighbour_network.build(11, 2, [1.0], 8, 4, 1.6, "net").save(tmp_path / "model.keras")
    with pytest.raises(InputError, match=r"model\.keras: not a model of neighbours, or one of an earlier version"):
        answer(tmp_path / "model.keras", *slurry())
    with zipfile.ZipFile(tmp_path / "model.keras", "w") as archive:
        archive.writestr("metadata.json", "{}")
    with pytest.raises(InputError, match=r"model\.keras: not a readable Keras model"):
        answer(tmp_path / "model.keras", *slurry())
    history, edges_um = slurry()
    with pytest.raises(InputError, match="was trained on 3 input frames, asked with 2"):
        answer(model, history[:, 1:], edges_um[1:])
    asked = prediction_input(history, edges_um)
    asked = replace(asked, particles=replace(asked.particles, phase_names=(*PHASES, "pore")))
    with pytest.raises(InputError, match="was trained on 3 phases, slurry 1 has 4"):
        neighbours.predict(asked, model, SETTINGS)


def test_windows_of_input_frames_lie_in_the_run():
    assert neighbours.windows([7, 8, 9, 10], 2) == [[5, 6, 7, 8], [6, 7, 8, 9], [7, 8, 9, 10]]
    assert neighbours.windows([1, 2, 3], 2) == [[0, 1, 2], [1, 2, 3]]


def shrinking(*log_volumes: float) -> dict[int, np.ndarray]:
    """Edges of a box with these logarithms of the volume at frames 0, 1 and so on."""
    return {k: np.full(3, np.exp(value / 3)) for k, value in enumerate(log_volumes)}


def test_intermediate_targets_are_shares_of_the_way_of_the_volume():
    # from frame 1 on 3 to go, of which 1, 1.9, 2.1, 3, 2.8 and 3 are gone
    edges_um = shrinking(5, 4, 3, 2.1, 1.9, 1, 1.2, 1)
    settings = {"target_frame": 7, "intermediate_targets": [0.3, 0.65, 0.95]}

    def stages(last_frame):
        found = neighbours.stages(edges_um, last_frame, settings)
        return [(one.before, one.after, pytest.approx(one.part)) for one in found]

    end = (7, 7, 1.0)
    assert stages(1) == [(1, 2, 0.9), (3, 4, 0.25), (4, 5, 0.25 / 0.3), end]
    assert stages(6) == [(6, 7, 0.3), (6, 7, 0.65), (6, 7, 0.95), end]
    edges_um = dict.fromkeys(range(8), np.ones(3))  # nothing to go
    assert stages(1) == [(1, 2, 0.3), (1, 2, 0.65), (1, 2, 0.95), end]


def test_frames_that_are_read_are_those_that_are_needed():
    edges_um = shrinking(*np.linspace(1, 0, 101))
    settings = {
        "input_frames": [8, 10],
        "earlier_frames": 1,
        "target_frame": 100,
        "intermediate_targets": [0.5],
        "layers": 3,
    }
    assert neighbours.needed_frames(settings, edges_um) == [7, 8, 9, 10, 54, 55, 100]
    assert neighbours.needed_frames(settings, edges_um, moved=False) == [8, 10, 54, 55, 100]
    with pytest.raises(InputError, match="frame 101 is not among the frames 0 to 100"):
        neighbours.needed_frames({**settings, "target_frame": 101}, edges_um)


def test_layers_are_asked_for_where_particles_are_on_the_way():
    """The last estimate is the answer, and the targets are places in the final box."""
    from slurrycast.surrogates import neighbour_network

    seen = trajectory("T1", 1)
    own = neighbours.example(seen, [8, 9, 10], SETTINGS)
    assert own.moved_um.shape == (2, 60, 3)
    scaled = {number: frame.position_um / frame.edges_um for number, frame in seen.frames.items()}
    log_volume = {number: np.log(edges_um).sum() for number, edges_um in seen.edges_um.items()}
    part = 0.08 * (log_volume[120] - log_volume[10]) / (log_volume[11] - log_volume[10])
    assert 0.2 < part < 1
    for moved_um, there in zip(own.moved_um, ((1 - part) * scaled[10] + part * scaled[11], scaled[120]), strict=True):
        expected = there * EDGES_UM - own.seen.affine_um
        np.testing.assert_allclose(moved_um, expected - expected.mean(axis=0), atol=1e-6)
    network = neighbour_network.build(11, 2, [0.5, 0.8, 1.0], 8, 4, 1.6, "net")
    for weights in network.weights:
        weights.assign(np.random.default_rng(0).normal(0, 0.3, weights.shape))
    inputs = [getattr(own.seen, name) for name in neighbours.INPUTS]
    moved_um, log_variance = network(inputs)
    both_um, same = neighbour_network.by_layer(network, 2)(inputs)
    np.testing.assert_allclose(both_um[-1], moved_um, atol=1e-6)
    np.testing.assert_allclose(same, log_variance, atol=1e-6)
    assert np.abs(both_um[0] - both_um[1]).max() > 1e-3


def test_first_frame_seen_is_the_end_of_the_earliest_window():
    assert neighbours.first_frame_seen([7, 8, 9, 10], {"earlier_frames": 0}) == 10
    assert neighbours.first_frame_seen([7, 8, 9, 10], {"earlier_frames": 7}) == 3
    assert neighbours.first_frame_seen([7, 8, 9, 10], {"earlier_frames": 20}) == 3
    assert neighbours.first_frame_seen([2, 6, 10], {"earlier_frames": 7}) == 8


def test_each_layer_stands_for_a_share_of_the_way():
    settings = {"intermediate_targets": [0.2, 0.6]}
    assert neighbours.layer_shares({**settings, "layers": 3}) == [0.2, 0.6, 1.0]
    assert neighbours.layer_shares({**settings, "layers": 5}) == [0.2, 0.2, 0.2, 0.6, 1.0]
    assert neighbours.layer_shares({"intermediate_targets": [], "layers": 2}) == [1.0, 1.0]


@pytest.mark.parametrize(("share", "scale"), [(0.0, 1.2), (0.5, np.sqrt(1.2))])
def test_gap_is_that_in_the_box_of_the_time(share, scale):
    """Two that touch in a box `scale` times as wide as the final one get the answer of two that touch there."""
    from slurrycast.surrogates import neighbour_network

    layer = neighbour_network.Interaction(8, 4, 1.6, share)
    layer.build()
    rng = np.random.default_rng(0)
    for weights in layer.weights:
        weights.assign(rng.normal(0, 0.3, weights.shape))
    n_distances = len(neighbour_network.DISTANCES_UM)
    seen = layer.of_places.kernel.numpy()
    seen[:n_distances] = seen[-3:-1] = 0  # deaf to the distance itself
    layer.of_places.kernel.assign(seen)
    left = np.full(2, -3 * np.log(1.2), dtype=np.float32)
    state, vectors, moved_um = np.ones((2, 8), "f4"), np.zeros((2, 3, 4), "f4"), np.zeros((2, 3), "f4")

    def answer(distance_um, radius_um, left):
        apart = np.array([[distance_um, 0, 0], [-distance_um, 0, 0]], "f4")
        layer.cutoff_um = 1.6 * distance_um  # whose envelope would tell the distance
        radii_um = np.full(2, radius_um, "f4")
        pairs = np.array([0, 1], "i4"), np.array([1, 0], "i4")
        return layer.call(state, vectors, moved_um, radii_um, left, *pairs, apart)[0].numpy()

    touching = answer(0.8 / scale, 0.4, left)
    np.testing.assert_allclose(touching, answer(0.8, 0.4, np.zeros(2, "f4")), atol=1e-4)
    assert np.abs(touching - answer(0.75 / scale, 0.4, left)).max() > 1e-3


def test_shapes_are_few_and_fit_all():
    assert neighbours.shapes([(90, 900), (90, 900)]) == [(90, 900)]
    assert neighbours.shapes([(40, 400), (60, 601), (90, 900)]) == [(40, 400), (90, 900)]  # 601 pairs are one too many
    sizes = [(n, 25 * n + n // 7) for n in (343, 600, 601, 1205, 1560, 1800, 2400)]
    known = neighbours.shapes(sizes)
    assert known[-1] == sizes[-1] and len(known) == 4
    for n, m in sizes:
        fitting = next(shape for shape in known if n <= shape[0] and m <= shape[1])
        assert fitting[0] < 1.6 * n


@pytest.mark.parametrize("shape", [(60, 4000), (71, 4000), (90, 3000)])
def test_slurry_filled_up_gets_the_same_answer(shape):
    """What is added says nothing to the others, and stays finite itself."""
    from slurrycast.surrogates import neighbour_network

    own = neighbours.example(trajectory("T1", 1), [8, 9, 10], SETTINGS)
    assert own.size[0] == 60 and own.size[1] < 3000
    more = neighbours.filled(own, [(60, own.size[1] - 1), shape], SETTINGS["cutoff_um"])
    assert more.size == shape
    network = neighbour_network.build(11, 2, [0.5, 0.8, 1.0], 8, 4, 1.6, "net")
    for weights in network.weights:
        weights.assign(np.random.default_rng(0).normal(0, 0.3, weights.shape))
    expected, found = (network([getattr(one.seen, name) for name in neighbours.INPUTS]) for one in (own, more))
    for one, other in zip(expected, found, strict=True):
        np.testing.assert_allclose(other[:60], one, atol=1e-6)
        assert np.isfinite(other).all()
    np.testing.assert_array_equal(more.moved_um[:, :60], own.moved_um)
    assert not more.moved_um[:, 60:].any()


def test_step_on_a_slurry_filled_up_is_the_same_step():
    import keras
    import tensorflow as tf

    own = neighbours.example(trajectory("T1", 1), [8, 9, 10], {**SETTINGS, "intermediate_targets": []})
    assert own.moved_um.shape == (1, 60, 3)
    more = neighbours.filled(own, [(77, 4000)], SETTINGS["cutoff_um"])
    keras.utils.set_random_seed(3)
    shape = {"n_scalars": 11, "n_past": 2, "shares": [0.5, 1.0], "width": 8, "n_vectors": 4, "cutoff_um": 1.6}
    training = neighbours._Training(shape, 1, SETTINGS)
    start = [variable.numpy() for variable in (*training.network.weights, *training.optimizer.variables)]
    ends = []
    for one in (own, more):
        for variable, value in zip((*training.network.weights, *training.optimizer.variables), start, strict=True):
            variable.assign(value)
        training.optimizer.learning_rate.assign(0.05)
        arguments = tf.constant(60), tf.constant(one.moved_um), *neighbours._inputs(one.seen)
        losses = [[float(loss) for loss in training.step(*arguments)] for _ in range(3)]
        ends.append((losses, [weights.numpy() for weights in training.network.weights]))
    np.testing.assert_allclose(ends[0][0], ends[1][0], rtol=1e-4)
    assert ends[0][0][2][0] < ends[0][0][0][0]
    for one, other, before in zip(ends[0][1], ends[1][1], start[: len(ends[0][1])], strict=True):
        np.testing.assert_allclose(one, other, atol=1e-3)
        assert not np.array_equal(one, before)


def test_layers_of_the_inputs_and_of_the_variance_learn_by_adam():
    shape = {"n_scalars": 11, "n_past": 2, "shares": [0.5, 1.0], "width": 8, "n_vectors": 4, "cutoff_um": 1.6}
    training = neighbours._Training(shape, 1, SETTINGS)
    matrices = [variable for variable in training.network.trainable_variables if len(variable.shape) == 2]
    by_adam = {v.path.split("/")[-2] for v in matrices if training.optimizer._should_use_adamw(v)}
    assert by_adam == set(neighbours.LEARN_BY_ADAM)
    assert len(matrices) == 4 + 2 * 10  # these, and ten in each layer


def test_compiled_prediction_is_the_same(model, monkeypatch):
    operation_by_operation = answer(model, *slurry())
    monkeypatch.setattr(neighbours, "COMPILED_FROM", 0)
    for one, other in zip(answer(model, *slurry()), operation_by_operation, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5)


def test_without_validation_slurries_their_columns_are_empty(tmp_path):
    fit({**SETTINGS, "members": 1, "epochs": 1}, tmp_path, validation=())
    header, row = (tmp_path / "history.csv").read_text().splitlines()
    assert header == "epoch,loss,mae,val_loss,val_mae"
    assert row.endswith(",,") and row.count(",") == 4


def test_validation_slurries_change_nothing_but_their_losses(tmp_path):
    for name, validation in (("with", ("V1",)), ("without", ())):
        fit({**SETTINGS, "members": 1}, tmp_path / name, validation)
    one, other = (answer(tmp_path / name / "model.keras", *slurry())[0] for name in ("with", "without"))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(("frames", "fits"), [([8, 9, 10], True), ([7, 8, 9, 10], False)])
def test_trained_network_is_adopted_if_its_input_frames_fit(command, model, tmp_path, frames, fits):
    options = {"trained": model, "model": tmp_path / "out.keras", "history": tmp_path / "out.csv"}
    options |= {"cost": tmp_path / "cost.json", "input_frames": frames}
    done = subprocess.run(command("adopt_model", surrogate="neighbours", **options), capture_output=True, text=True)
    assert (done.returncode == 0) == fits, done.stderr
    if fits:
        assert (tmp_path / "out.keras").read_bytes() == model.read_bytes()
    else:
        assert "neighbours needs 3 x 3" in done.stderr


def test_model_of_another_kind_is_not_adopted(command, tmp_path):
    """Its inputs would fit: that of an earlier version is such a file."""
    from slurrycast.surrogates import neighbour_network

    neighbour_network.build(11, 2, [1.0], 8, 4, 1.6, "net").save(tmp_path / "model.keras")
    options = {"trained": tmp_path / "model.keras", "model": tmp_path / "out.keras", "history": tmp_path / "out.csv"}
    options |= {"cost": tmp_path / "cost.json", "input_frames": [8, 9, 10]}
    done = subprocess.run(command("adopt_model", surrogate="neighbours", **options), capture_output=True, text=True)
    assert done.returncode == 1
    assert f"{tmp_path / 'model.keras'} is no model of neighbours, or one of an earlier version" in done.stderr
    assert not (tmp_path / "out.keras").exists()


def test_report_describes_the_ensemble(model):
    network = read_network(model)
    assert [layer.name for layer in network.layers[:-1]] == [f"Input {name}" for name in neighbours.INPUTS]
    ensemble = network.layers[-1]
    assert ensemble.name == "Ensemble of 2 networks, 2 layers of width 8"
    assert ensemble.parameters == network.parameters
    from slurrycast.surrogates import neighbour_network

    one = neighbour_network.build(11, 2, [0.08, 1.0], 8, 4, 1.6, "net")
    assert network.parameters == 2 * one.count_params()
