"""The registry of surrogates and the script that trains one of them."""

import csv
import json
import os
import subprocess
import sys

import numpy as np
import pytest

from slurrycast import surrogates
from slurrycast.data import final_box
from slurrycast.data.dataset import TrainingSet, split, write_training_set
from slurrycast.dem.lammps_run import SCRIPTS
from slurrycast.runtime.files import InputError, checksum


@pytest.mark.parametrize("name", surrogates.NAMES)
def test_every_surrogate_has_the_interface(name):
    surrogate = surrogates.load(name)
    assert name == surrogate.NAME
    assert surrogate.LOOKS_AT
    assert surrogate.BOX_RULE in final_box.RULES
    assert surrogate.MODEL_FILE in (None, "model.json", "model.keras")
    assert hasattr(surrogate, "fit") == (surrogate.MODEL_FILE is not None)
    assert surrogate.CONTINUES_DEM is None or (SCRIPTS / surrogate.CONTINUES_DEM).is_file()
    assert surrogate.BOX_RULE != "simulated" or surrogate.CONTINUES_DEM
    assert callable(surrogate.predict)
    assert surrogate.HAS_SPREAD is (name == "neighbours")


@pytest.mark.parametrize(
    ("text", "name", "settings", "last_frame"),
    [
        ("affine", "affine", {}, None),
        ("affine_f02", "affine", {}, 2),
        ("affine_f110", "affine", {}, 110),
        ("vgg16", "vgg16", {}, None),
        ("vgg16_relative", "vgg16", {"coordinates": "relative"}, None),
        ("vgg16_box", "vgg16_box", {}, None),
        ("vgg16_box_nobox", "vgg16_box", {"change": "nobox"}, None),
        ("early_dem_x10", "early_dem", {"faster": "10"}, None),
        ("early_dem_x10_f04", "early_dem", {"faster": "10"}, 4),
    ],
)
def test_labels_are_taken_apart(text, name, settings, last_frame):
    assert surrogates.parse(text) == surrogates.Label(text, name, settings, last_frame)


@pytest.mark.parametrize("text", ["", "Affine", "affine_", "affine_f2", "affine_x2", "early_dem", "vgg16_b"])
def test_other_labels_are_refused(text):
    with pytest.raises(InputError, match=f"surrogate: '{text}' is not known"):
        surrogates.parse(text)


def test_input_frames_of_a_label():
    assert surrogates.parse("affine").input_frames([7, 8, 9, 10]) == [7, 8, 9, 10]
    assert surrogates.parse("affine_f09").input_frames([7, 8, 9, 10]) == [6, 7, 8, 9]
    assert surrogates.parse("affine_f01").input_frames([7, 8, 9, 10]) == [0, 1]


def test_an_unknown_surrogate_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"surrogate: 'vgg19' is not known, allowed: .*vgg16"):
        surrogates.load("vgg19")


def test_asking_for_a_surrogate_starts_no_tensorflow(root):
    code = """
import sys
from slurrycast import surrogates
from slurrycast.data import final_box
for name in surrogates.NAMES: surrogates.load(name)
assert not {'keras', 'tensorflow'} & set(sys.modules)
"""
    env = os.environ | {"PYTHONPATH": str(root / "scripts")}
    subprocess.run([sys.executable, "-c", code], env=env, check=True)


def test_the_script_writes_its_outputs_and_keeps_the_finished_model(tmp_path, monkeypatch):
    import train_surrogate

    n = 30
    rng = np.random.default_rng(0)
    features = rng.normal(size=(n, 2, 6))
    names = ("phase", "radius_um", "x_um", "y_um", "z_um", "coordination")
    index = np.zeros(n, dtype=int)
    data = TrainingSet(
        features,
        features[:, -1, 2:5],
        index,
        ("T1",),
        np.arange(n),
        split(n, 0.2, 1),
        names,
        (7, 8),
        20,
        input_edges_um=np.ones((1, 2, 3)),
        target_edges_um=np.ones((1, 3)),
    )
    write_training_set(tmp_path / "training.h5", data, seed=1)
    vgg16 = surrogates.load("vgg16")
    monkeypatch.setattr(vgg16, "BLOCKS", ((4,), (4,)))
    monkeypatch.setattr(vgg16, "DENSE_UNITS", 8)
    places = {name: tmp_path / name for name in ("work", "model.keras", "history.csv", "cost.json")}
    settings = json.dumps({"epochs": 3, "batch_size": 10, "learning_rate": 1e-3, "threads": 1})
    arguments = ["--surrogate", "vgg16", "--dataset", tmp_path / "training.h5", "--settings", settings, "--seed", 3]
    for option, place in zip(("--work", "--model", "--history", "--cost"), places.values(), strict=True):
        arguments += [option, place]
    monkeypatch.setattr(sys, "argv", ["train_surrogate.py", *map(str, arguments)])
    train_surrogate.main()

    written = {name: (tmp_path / name).read_bytes() for name in ("history.csv", "model.keras")}
    assert not (places["work"] / "checkpoint.h5").exists()
    with places["history.csv"].open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["epoch", "loss", "mae", "val_loss", "val_mae"]
    assert [row["epoch"] for row in rows] == ["1", "2", "3"]
    cost = json.loads(places["cost.json"].read_text())
    assert (cost["stage"], cost["surrogate"], cost["particles"]) == ("train_surrogate", "vgg16", n)

    # A workflow that was killed before it took note of the outputs asks again: the training is not repeated.
    for name in written:
        places[name].unlink()
    monkeypatch.setattr(vgg16, "fit", None)
    train_surrogate.main()
    assert {name: places[name].read_bytes() for name in written} == written
    assert json.loads(places["cost.json"].read_text())["cpu_s"] > cost["cpu_s"]

    # With other code it would be another model, so it is.
    monkeypatch.setattr(train_surrogate, "code_of", lambda surrogate: [f"edited {surrogate}"])
    with pytest.raises(TypeError, match="'NoneType' object is not callable"):
        train_surrogate.main()


def test_code_of_a_surrogate_is_its_modules_and_libraries(root):
    import train_surrogate

    code = train_surrogate.code_of("neighbours")
    for module in ("neighbours", "neighbour_network", "checkpoint"):
        assert checksum(root / "scripts" / "slurrycast" / "surrogates" / f"{module}.py") in code
    assert any(entry.startswith("keras 3") for entry in code)
    assert any(entry.startswith("tensorflow") for entry in code)
    assert code != train_surrogate.code_of("vgg16")
