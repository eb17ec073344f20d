"""The table of the ablation, of made-up curves and skills, and models that come from elsewhere."""

import json

import numpy as np
import pandas as pd
import pytest

from script_runs import run_script
from slurrycast.data.dataset import TrainingSet, write_training_set
from slurrycast.data.tables import read_table

LABELS = ["vgg16", "vgg16_box_xu", "vgg16_box_absolute", "vgg16_box_nobox", "vgg16_box"]
ROLES = {"V1": "validation", "V2": "validation", "1": "test", "6": "test"}
NAMES = ("phase", "radius_um", "x_um", "y_um", "z_um", "coordination")


@pytest.fixture
def run(tmp_path):
    """Tabulate; the MSE of a label is 0.1 x (its row + place of the slurry), in a training set of one small slurry."""
    rows = [
        {"surrogate": label, "slurry": slurry, "mse_um2": 0.1 * (row + place), "mse_affine_um2": 0.5, "floor_um2": 0}
        | {"skill": np.nan if slurry == "1" else 1 - 0.2 * (row + place)}
        for row, label in enumerate([*LABELS, "affine"])
        for place, slurry in enumerate(ROLES)
    ]
    pd.DataFrame(rows).to_csv(tmp_path / "skill.csv", index=False)
    edges_um = np.array([[[8.0, 8, 8], [6, 6, 6]]])
    targets = np.array([[0.5, 0.5, 0.5], [0.8, 0.5, 0.5], [9, 9, 9], [9, 9, 9]])  # affine: 1 / 6 x 3 = 0.5
    held = np.array([True, True, False, False])
    of_particles = (np.zeros(4, dtype=int), ("T1",), np.arange(4), held)
    data = TrainingSet(np.ones((4, 2, 6)), targets, *of_particles, NAMES, (9, 10), 120, edges_um, np.full((1, 3), 3.0))
    write_training_set(tmp_path / "training.h5", data, seed=1)

    def start(labels=LABELS, roles=ROLES, epochs=3):
        histories = []
        for number, label in enumerate(labels):
            histories.append(tmp_path / f"{label}.csv")
            curve = {"epoch": [1, 2, 3], "loss": [9, 8, 7], "mae": [3, 2, 1], "val_loss": [5, 2 + number, 4 + number]}
            pd.DataFrame(curve)[:epochs].assign(val_mae=1).to_csv(histories[-1], index=False)
        paths = {"dataset": "training.h5", "skill": "skill.csv", "table": "ablation.csv"}
        options = {name: tmp_path / file for name, file in paths.items()}
        options |= {"surrogates": labels, "histories": histories, "roles": json.dumps(roles)}
        return run_script("tabulate_ablation", **options)

    return start


def test_rows_say_what_each_network_is_and_how_good(run, tmp_path):
    done = run()
    assert done.returncode == 0, done.stderr
    table = read_table(tmp_path / "ablation.csv").set_index("surrogate")
    assert list(table.index) == [*LABELS, "affine"]
    forms = [tuple(row) for row in table[["target", "coordinates", "box"]].to_numpy()]
    assert forms == [
        ("absolute", "xu", "no"),
        ("displacement", "xu", "yes"),
        ("absolute", "scaled", "yes"),
        ("displacement", "scaled", "no"),
        ("displacement", "scaled", "yes"),
        ("-", "scaled", "yes"),
    ]
    assert table.standardised.tolist() == ["no", "yes", "yes", "yes", "yes", "-"]
    assert table.epochs.fillna(0).tolist() == [3, 3, 3, 3, 3, 0]
    # val_loss 5, 2 + number, 4 + number: the second epoch is the best until its loss is above 5
    np.testing.assert_allclose(table.best_val_loss_um2, [2, 3, 4, 5, 5, 0.3**2 / 6])
    assert table.best_epoch.fillna(0).tolist() == [2, 2, 2, 1, 1, 0]
    rows = np.arange(6)
    np.testing.assert_allclose(table.validation_mse_um2, 0.1 * (rows + 0.5))
    np.testing.assert_allclose(table.test_mse_um2, 0.1 * (rows + 2.5))
    np.testing.assert_allclose(table.validation_skill, 1 - 0.2 * (rows + 0.5))
    np.testing.assert_allclose(table.test_skill, 1 - 0.2 * (rows + 3))  # of slurry 6 alone: 1 has no floor


def test_variants_of_the_published_network_without_curves(run, tmp_path):
    labels = ["vgg16", "vgg16_relative", "vgg16_standardised"]
    skill = pd.read_csv(tmp_path / "skill.csv", dtype=str)
    variants = [skill[skill.surrogate == "vgg16"].assign(surrogate=label) for label in labels[1:]]
    pd.concat([skill, *variants]).to_csv(tmp_path / "skill.csv", index=False)
    assert run(labels=labels, epochs=0).returncode == 0
    table = read_table(tmp_path / "ablation.csv").set_index("surrogate").loc[labels]
    assert table.coordinates.tolist() == ["xu", "relative", "xu"]
    assert table.standardised.tolist() == ["no", "no", "yes"]
    assert table[["epochs", "best_epoch", "best_val_loss_um2"]].isna().all(axis=None)


def test_a_role_without_slurries_is_empty(run, tmp_path):
    assert run(roles=dict.fromkeys(ROLES, "test")).returncode == 0
    table = read_table(tmp_path / "ablation.csv")
    assert table.validation_mse_um2.isna().all() and table.test_mse_um2.notna().all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"labels": ["linear"]}, "linear is not part of the ablation, allowed: vgg16 and vgg16_box"),
        ({"labels": ["vgg16_f02"]}, "has no row of vgg16_f02"),
        ({"roles": {"V1": "validation", "1": "test"}}, "slurry 6, V2 has none"),
    ],
)
def test_what_does_not_fit_is_refused_on_one_line(run, changes, message):
    done = run(**changes)
    assert done.returncode == 1
    assert done.stderr.startswith("error: ") and message in done.stderr and done.stderr.count("\n") == 1
