"""The registry of surrogates and the script that trains one of them."""

import json
import subprocess
import sys

import numpy as np
import pytest

from slurrycast import surrogates
from slurrycast.data.dataset import write_training_set
from slurrycast.dem.lammps_run import SCRIPTS
from slurrycast.runtime.files import InputError, checksum
from slurrycast.surrogates import base, vgg16
from slurrycast.surrogates.base import Surrogate
from structures import training_set


@pytest.mark.parametrize("name", surrogates.NAMES)
def test_every_surrogate_has_the_interface(name):
    surrogate = surrogates.load(name)
    assert surrogate.name == name and surrogate.looks_at
    assert isinstance(surrogate.box_rule, base.BoxRule)
    assert surrogate.model_file in (None, "model.json", "model.keras")
    assert surrogate.learns_from in ((None,) if surrogate.model_file is None else ("samples", "frames"))
    assert surrogate.weights_epoch in (("lowest", "last") if surrogate.is_trained else (None,))
    assert surrogate.dem_script is None or (SCRIPTS / surrogate.dem_script).is_file()
    assert surrogate.box_rule is not base.SIMULATED or surrogate.continues_dem
    assert not (surrogate.from_recipe and (surrogate.is_learned or surrogate.continues_dem))
    defined = {
        method for method in vars(Surrogate) if getattr(type(surrogate), method) is not getattr(Surrogate, method)
    }
    needed = {"train": surrogate.is_trained, "input_shapes": surrogate.is_trained, "fit": surrogate.is_fitted}
    needed |= {"most_steps": surrogate.continues_dem, "predict": True}
    assert {method: method in defined for method in needed} == needed


def test_a_surrogate_needs_no_more_than_a_prediction(monkeypatch):
    monkeypatch.setattr(base, "REGISTERED", {})

    class Still(Surrogate):
        name, looks_at, box_rule = "still", "nothing", base.LAST_FRAME

        def predict(self, inputs, model_path, settings):
            return inputs

    surrogate = base.REGISTERED["still"]
    assert isinstance(surrogate, Still)
    for property in (
        "is_learned",
        "is_trained",
        "is_fitted",
        "continues_dem",
        "has_spread",
        "needs_packing_fraction",
        "from_recipe",
    ):
        assert getattr(surrogate, property) is False
    assert surrogate.first_frame_seen([7, 8, 10], {}) == 10
    assert surrogate.needed_frames({"input_frames": [7, 8], "target_frame": 20}, {}) == [7, 8, 20]


def test_an_unknown_surrogate_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"surrogate: 'vgg19' is not known, allowed: .*vgg16"):
        surrogates.load("vgg19")


def test_asking_for_a_surrogate_starts_no_tensorflow():
    code = """
import sys
from slurrycast import surrogates
for name in surrogates.NAMES: surrogates.load(name)
assert not {'keras', 'tensorflow'} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_script_writes_its_outputs_and_keeps_the_finished_model(tmp_path, monkeypatch, run_main, capsys):
    import train_surrogate

    n = 30
    rng = np.random.default_rng(0)
    features = rng.normal(size=(n, 2, 6))
    data = training_set(features, features[:, -1, 2:5], np.ones((1, 2, 3)), np.ones((1, 3)))
    write_training_set(tmp_path / "training.h5", data, seed=1)
    monkeypatch.setattr(vgg16, "BLOCKS", ((4,), (4,)))
    monkeypatch.setattr(vgg16, "DENSE_UNITS", 8)
    names = {"dataset": "training.h5", "model": "model.keras", "history": "history.csv", "cost": "cost.json"}
    paths = {option: tmp_path / name for option, name in names.items()} | {"work": tmp_path / "work"}

    def run(epochs=3):
        settings = json.dumps({"epochs": epochs, "batch_size": 10, "learning_rate": 1e-3, "threads": 1})
        run_main("train_surrogate", surrogate="vgg16", settings=settings, seed=3, **paths)

    run(epochs=2)
    assert "resuming" not in capsys.readouterr().out
    run()  # with more epochs it goes on
    assert "resuming after epoch 2" in capsys.readouterr().out
    written = {option: paths[option].read_bytes() for option in ("history", "model")}
    header, *rows = written["history"].decode().splitlines()
    assert header == "epoch,loss,mae,val_loss,val_mae"
    assert [row.split(",")[0] for row in rows] == ["1", "2", "3"]
    cost = json.loads(paths["cost"].read_text())
    assert (cost["stage"], cost["surrogate"], cost["particles"]) == ("train_surrogate", "vgg16", n)

    # A workflow that was killed before it took note of the outputs asks again: the training is not repeated.
    for option in written:
        paths[option].unlink()
    monkeypatch.setattr(surrogates.load("vgg16"), "train", None)
    run()
    assert {option: paths[option].read_bytes() for option in written} == written
    assert json.loads(paths["cost"].read_text())["cpu_s"] > cost["cpu_s"]

    # With other code it would be another model, so it is.
    monkeypatch.setattr(train_surrogate, "code_versions", lambda surrogate: [f"edited {surrogate}"])
    with pytest.raises(TypeError, match="'NoneType' object is not callable"):
        run()


def test_code_of_a_surrogate_is_its_modules_and_libraries(root):
    import train_surrogate

    code = train_surrogate.code_versions("neighbours")
    for module in ("neighbours/__init__", "neighbours/network", "checkpoint"):
        assert checksum(root / "scripts" / "slurrycast" / "surrogates" / f"{module}.py") in code
    assert any(entry.startswith("keras 3") for entry in code)
    assert any(entry.startswith("tensorflow") for entry in code)
    assert code != train_surrogate.code_versions("vgg16")
