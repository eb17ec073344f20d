"""Predictions: their bounds, and models that do not fit."""

import zipfile
from dataclasses import replace

import numpy as np
import pytest
from slurries import EDGES_UM, PHASES, SETTINGS, answer, particles_of, prediction_input, slurry

from slurrycast.runtime.files import InputError
from slurrycast.surrogates import neighbours
from slurrycast.surrogates.neighbours import Neighbours
from slurrycast.surrogates.neighbours.graph import mean_diameter_um
from slurrycast.surrogates.neighbours.network import build


@pytest.fixture
def members_answer(monkeypatch):
    """Let each member answer the same for all particles."""

    def put(moved: tuple[float, ...], log_variance: float) -> None:
        def answers(_, seen):
            n = len(seen.radius)
            return np.broadcast_to(np.array(moved, float), (n, 2, 3)), np.full((n, 2, 1), log_variance)

        monkeypatch.setattr(neighbours, "answers", answers)

    return put


@pytest.mark.parametrize(("log_variance", "spread"), [(40.0, 1.2), (1000.0, 1.2), (-40.0, 0.012), (-4.0, np.exp(-2))])
def test_spread_of_a_member_is_between_what_can_be_known_and_a_diameter(model, members_answer, log_variance, spread):
    members_answer((0, 0, 0), log_variance)
    history, edges_um = slurry()
    diameter_um = mean_diameter_um(particles_of(history))
    np.testing.assert_allclose(answer(model, history, edges_um)[1], spread * diameter_um)


@pytest.mark.parametrize(("moved", "found"), [((0, 0.3, 0.4), (0, 0.3, 0.4)), ((0, 24, -32), (0, 1.44, -1.92))])
def test_no_member_moves_a_particle_farther_than_any_went(model, members_answer, moved, found):
    members_answer(moved, -4.0)
    history, edges_um = slurry()
    affine_um = history[:, -1, 2:5] / edges_um[-1] * EDGES_UM
    moved_um = answer(model, history, edges_um)[0] - affine_um
    np.testing.assert_allclose(moved_um / mean_diameter_um(particles_of(history)), [found] * 60, atol=1e-12)


def test_models_that_do_not_fit_are_refused(model, tmp_path):
    (tmp_path / "model.keras").write_text("no model")
    with pytest.raises(InputError, match=r"model\.keras: not a readable Keras model"):
        answer(tmp_path / "model.keras", *slurry())
    build(11, 2, [1.0], 8, 4, 1.6, "net").save(tmp_path / "model.keras")
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
        Neighbours().predict(asked, model, SETTINGS)


def test_model_is_found_by_the_registered_names_of_its_layers(model, tmp_path):
    """A file from before a module was renamed can still be used."""
    with zipfile.ZipFile(model) as archive, zipfile.ZipFile(tmp_path / "model.keras", "w") as renamed:
        for name in archive.namelist():
            content = archive.read(name)
            assert name != "config.json" or b"slurrycast.surrogates.neighbours.network" in content
            renamed.writestr(name, content.replace(b"slurrycast.surrogates.neighbours.network", b"slurrycast.earlier"))
    for values, others in zip(answer(model, *slurry()), answer(tmp_path / "model.keras", *slurry()), strict=True):
        np.testing.assert_array_equal(values, others)


@pytest.fixture
def adopt(run_main, tmp_path):
    """Adopt a trained network."""

    def run(trained):
        options = {"trained": trained, "model": tmp_path / "out.keras", "history": tmp_path / "out.csv"}
        options["trained_on"] = tmp_path / "trained_on.json"
        run_main("adopt_model", surrogate="neighbours", **options, cost=tmp_path / "c.json")

    return run


@pytest.mark.parametrize("text", ["epoch,loss,val_loss\n1,0.2,0.3\n", "epoch,loss\n\xe9\n", ""])
def test_learning_curves_of_another_program_are_not_used(adopt, model, tmp_path, capsys, text):
    trained = tmp_path / "trained" / "model.keras"
    trained.parent.mkdir()
    trained.write_bytes(model.read_bytes())
    trained.with_name("history.csv").write_bytes(text.encode("latin-1"))
    adopt(trained)
    assert (tmp_path / "out.csv").read_text() == "epoch,loss,mae,val_loss,val_mae\n"
    assert (
        "history.csv: not used: must be a table (CSV) of numbers with the columns epoch, loss"
        in capsys.readouterr().out
    )


def test_trained_network_is_adopted(adopt, model, tmp_path):
    adopt(model)
    assert (tmp_path / "out.keras").read_bytes() == model.read_bytes()
    assert (tmp_path / "trained_on.json").read_text() == "{}\n"  # nothing is known of it
