"""Training: it learns, continues after a kill, and pads slurries without a trace."""

import re

import keras
import numpy as np
import pytest
import tensorflow as tf
from slurries import EDGES_UM, SETTINGS, SHAPE, answer, particles_of, random_network, slurry, train, trajectory

from slurrycast.runtime.files import InputError
from slurrycast.surrogates.backend import read_model
from slurrycast.surrogates.neighbours import Neighbours, training
from slurrycast.surrogates.neighbours.graph import mean_diameter_um
from slurrycast.surrogates.neighbours.network import tensors
from slurrycast.surrogates.neighbours.targets import make_example
from slurrycast.surrogates.neighbours.training import LEARN_BY_ADAM, Learner, filled, learning_rate_share, shapes
from slurrycast.surrogates.stored_model import stored_layers


def test_untrained_network_is_the_affine_map(tmp_path, monkeypatch):
    """Before the first step, so a training that learns nothing does no harm."""
    monkeypatch.setattr(training, "learning_rate_share", lambda share: 0.0)
    settings = {**SETTINGS, "weight_decay": 0.0, "members": 1, "epochs": 1}
    train(settings, tmp_path)
    history, edges_um = slurry()
    position_um, spread_um = answer(tmp_path / "model.keras", history, edges_um)
    np.testing.assert_allclose(position_um, history[:, -1, 2:5] / edges_um[-1] * EDGES_UM, atol=1e-6)
    np.testing.assert_allclose(spread_um, np.exp(-2.2 / 2) * mean_diameter_um(particles_of(history)), rtol=1e-5)


@pytest.mark.slow  # compiles a step, for half a minute
def test_training_learns(tmp_path):
    settings = {**SETTINGS, "members": 1, "epochs": 30}
    train(settings, tmp_path, compiled=True)
    loss = np.loadtxt(tmp_path / "history.csv", delimiter=",", skiprows=1)[:, 1]
    assert len(loss) == 30
    assert loss[-1] < 0.5 * loss[0]


@pytest.mark.slow
@pytest.mark.parametrize(("member", "starts"), [pytest.param(1, False, marks=pytest.mark.full), (2, False), (2, True)])
def test_killed_training_ends_like_an_undisturbed_one(model, tmp_path, monkeypatch, capsys, member, starts):
    settings, shares = SETTINGS | ({"start_from": str(model)} if starts else {}), []
    if starts:
        undisturbed = tmp_path / "undisturbed"
        undisturbed.mkdir()
        train(settings, undisturbed)
        model = undisturbed / "model.keras"

    def dies(share):
        shares.append(share)
        if len(shares) == 6 * (member - 1) + 5:  # in the last of three epochs of two slurries
            raise KeyboardInterrupt
        return learning_rate_share(share)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(training, "learning_rate_share", dies)
        train(settings, tmp_path)
    capsys.readouterr()
    spent = train(settings, tmp_path)
    assert f"[neighbours {member}] resuming after epoch 2" in capsys.readouterr().out
    assert (tmp_path / "history.csv").read_text() == (model.parent / "history.csv").read_text()
    for one, other in zip(answer(tmp_path / "model.keras", *slurry()), answer(model, *slurry()), strict=True):
        np.testing.assert_array_equal(one, other)
    assert spent["cpu_s"] > 0


def test_learning_rate_rises_and_falls():
    shares = np.linspace(0, 1, 101)
    rates = [learning_rate_share(share) for share in shares]
    assert rates[0] == 0
    assert max(rates) == pytest.approx(1) and rates.index(max(rates)) == 15
    assert rates[-1] == pytest.approx(0)


def test_shapes_are_few_and_fit_all():
    assert shapes([(90, 900), (90, 900)]) == [(90, 900)]
    assert shapes([(40, 400), (60, 601), (90, 900)]) == [(40, 400), (90, 900)]  # 601 pairs are one too many
    sizes = [(n, 25 * n + n // 7) for n in (343, 600, 601, 1205, 1560, 1800, 2400)]
    known = shapes(sizes)
    assert known[-1] == sizes[-1] and len(known) == 4
    for n, m in sizes:
        fitting = next(shape for shape in known if n <= shape[0] and m <= shape[1])
        assert fitting[0] < 1.6 * n


@pytest.mark.parametrize("shape", [(60, 4000), (71, 4000), (90, 3000)])
def test_slurry_filled_up_gets_the_same_answer(shape):
    """What is added says nothing to the others, and stays finite itself."""
    plain = make_example(trajectory("T1", 1), [8, 9, 10], SETTINGS)
    assert plain.size[0] == 60 and plain.size[1] < 3000
    more = filled(plain, [(60, plain.size[1] - 1), shape], SETTINGS["cutoff_diameters"])
    assert more.size == shape
    network = random_network()
    expected, actual = (network(tensors(example.graph)) for example in (plain, more))
    for one, other in zip(expected, actual, strict=True):
        np.testing.assert_allclose(other[:60], one, atol=1e-6)
        assert np.isfinite(other).all()
    np.testing.assert_array_equal(more.moved[:, :60], plain.moved)
    assert not more.moved[:, 60:].any()


@pytest.mark.slow  # compiles a step twice
def test_step_on_a_slurry_filled_up_is_the_same_step():
    plain = make_example(trajectory("T1", 1), [8, 9, 10], {**SETTINGS, "intermediate_targets": []})
    assert plain.moved.shape == (1, 60, 3)
    more = filled(plain, [(77, 4000)], SETTINGS["cutoff_diameters"])
    keras.utils.set_random_seed(3)
    learner = Learner(SHAPE, 1, SETTINGS)
    start = [variable.numpy() for variable in (*learner.network.weights, *learner.optimizer.variables)]
    ends = []
    for example in (plain, more):
        for variable, value in zip((*learner.network.weights, *learner.optimizer.variables), start, strict=True):
            variable.assign(value)
        learner.optimizer.learning_rate.assign(0.05)
        arguments = tf.constant(60), tf.constant(example.moved), *tensors(example.graph)
        losses = [[float(loss) for loss in learner.step(*arguments)] for _ in range(3)]
        ends.append((losses, [weights.numpy() for weights in learner.network.weights]))
    np.testing.assert_allclose(ends[0][0], ends[1][0], rtol=1e-4)
    assert ends[0][0][2][0] < ends[0][0][0][0]
    for one, other, before in zip(ends[0][1], ends[1][1], start[: len(ends[0][1])], strict=True):
        np.testing.assert_allclose(one, other, atol=1e-3)
        assert not np.array_equal(one, before)


def test_layers_of_the_inputs_and_of_the_variance_learn_by_adam():
    learner = Learner(SHAPE, 1, SETTINGS)
    matrices = [variable for variable in learner.network.trainable_variables if len(variable.shape) == 2]
    by_adam = {v.path.split("/")[-2] for v in matrices if learner.optimizer._should_use_adamw(v)}
    assert by_adam == set(LEARN_BY_ADAM)
    assert len(matrices) == 4 + 2 * 10  # these, and ten in each layer


@pytest.mark.slow
def test_validation_slurries_change_nothing_but_their_losses(model, tmp_path):
    train(SETTINGS, tmp_path, validation=())
    for one, other in zip(answer(tmp_path / "model.keras", *slurry()), answer(model, *slurry()), strict=True):
        np.testing.assert_array_equal(one, other)
    header, *rows = (tmp_path / "history.csv").read_text().splitlines()
    assert header == "epoch,loss,mae,val_loss,val_mae"
    assert all(row.endswith(",,") and row.count(",") == 4 for row in rows)


def test_members_go_on_each_from_its_own(model, tmp_path, monkeypatch):
    """Before the first step they are those of the stored model."""
    monkeypatch.setattr(training, "learning_rate_share", lambda share: 0.0)
    train({**SETTINGS, "weight_decay": 0.0, "epochs": 1, "start_from": str(model)}, tmp_path)
    started, stored = (
        read_model(path).get_layer("ensemble").flat_weights().numpy() for path in (tmp_path / "model.keras", model)
    )
    np.testing.assert_array_equal(started, stored)
    assert np.abs(stored[0] - stored[1]).max() > 0.1


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"members": 3}, "has 2 members, needed are 3: each goes on from its own"),
        ({"width": 16}, "has width 8, needed is 16"),
        ({"cutoff_diameters": 1.9}, "has cutoff 2.0, needed is 1.9"),
        ({"input_frames": [9, 10]}, "was trained on 3 input frames, needed are 2"),
        ({"layers": 3}, r"has layers and intermediate targets \[0.08, 1.0\], needed is \[0.08, 0.08, 1.0\]"),
    ],
)
def test_a_stored_ensemble_that_does_not_fit_is_refused(model, tmp_path, changes, says):
    settings = {**SETTINGS, **changes, "start_from": str(model)}
    with pytest.raises(InputError, match=f"model.keras: {says}"):
        train(settings, tmp_path)
    problem = Neighbours().misfit(stored_layers(model), len(settings["input_frames"]), 3, settings)
    assert re.fullmatch(says, problem)
    assert Neighbours().misfit(stored_layers(model), 3, 3, SETTINGS) is None
