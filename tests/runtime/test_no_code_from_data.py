"""Data stays data: no pickle, nothing that a file or a configuration says is evaluated or reaches a shell unquoted."""

import ast
import json
import re
import zipfile

import keras
import numpy as np
import pytest

from slurrycast.runtime.files import InputError
from slurrycast.surrogates.vgg16 import apply_model

# modules and functions that run what they read, and options that let them
MODULES = {"pickle", "_pickle", "cPickle", "dill", "cloudpickle", "joblib", "shelve", "marshal", "torch", "code"}
CALLS = {"eval", "exec", "__import__", "read_pickle", "to_pickle", "read_hdf", "system", "popen", "getoutput"}
CALLS |= {"enable_unsafe_deserialization", "unsafe_load", "full_load", "load_module", "run_path"}
UNSAFE = {("shell", "True"), ("allow_pickle", "True"), ("safe_mode", "False"), ("engine", "'python'")}


def findings(source: str) -> list[str]:
    """What in a Python file could run data as code."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias.name for alias in node.names]
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else names
            found += [f"import {name}" for name in names if name.partition(".")[0] in MODULES]
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            owner = ast.unparse(node.func).rpartition(".")[0]
            options = {option.arg: ast.unparse(option.value) for option in node.keywords}
            if name in CALLS:
                found.append(name)
            if name == "load_model" and options.get("safe_mode") != "True":
                found.append("load_model without safe_mode=True")
            if name in ("load", "load_all") and owner == "yaml":
                found.append("yaml.load")
            found += [f"{key}={value}" for key, value in options.items() if (key, value) in UNSAFE]
    return found


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "from joblib import load",
        "import torch.nn as nn",
        "eval(file.attrs['physics'])",
        "pd.read_pickle(path)",
        "np.load(path, allow_pickle=True)",
        "keras.saving.load_model(path)",
        "keras.saving.load_model(path, safe_mode=False)",
        "subprocess.run(command, shell=True)",
        "os.system(command)",
        "yaml.load(text, Loader=yaml.Loader)",
        "table.eval(expression, engine='python')",
    ],
)
def test_what_is_looked_for_is_found(source):
    assert findings(source)


def test_no_script_runs_data_as_code(root):
    files = sorted((root / "scripts").rglob("*.py"))
    assert len(files) > 70
    assert {str(path.relative_to(root)): found for path in files if (found := findings(path.read_text()))} == {}


def test_rules_hand_text_to_the_shell_quoted_only(root):
    """In every `shell:`, what is not quoted (`:q`) is one of these numbers, or a list of some."""
    numbers = {"runtime", "budgeted", "tasks", "seed", "steps", "bins"}
    numbers |= {"input_frames", "first_frame", "last_frame", "last_input_frame", "target_frame", "input_steps"}
    numbers |= {"first_frame_seen", "restart_frames"}
    numbers |= {"cutoff_um", "displacement_um", "frame_interval_us", "validation_share"}
    numbers |= {"max_density_difference", "max_density_drift", "pressure_kpa", "max_kinetic_share", "pressure_within"}
    numbers |= {"temperature_k", "green_density_g_cm3", "share_total", "points", "replicas", "confirmations"}
    shells = 0
    for path in [root / "Snakefile", *sorted((root / "workflow" / "rules").rglob("*.smk"))]:
        text = path.read_text()
        assert re.search(r"^\s*(run|script|notebook|wrapper):", text, re.MULTILINE) is None
        for shell in re.findall(r'^ +shell:\n((?: +".*\n)+)', text, re.MULTILINE):
            shells += 1
            for place in re.findall(r"\{(.*?)\}", shell):
                section, _, name = place.partition(".")
                unquoted = not place.endswith(":q")
                assert not unquoted or (section in ("params", "resources") and name in numbers), (path.name, place)
        assert text.count(" shell:") == len(re.findall(r'^ +shell:\n +"', text, re.MULTILINE))
    assert shells > 30


# ---- Keras models


def edited(path, edit) -> None:
    """Change the configuration in a .keras file."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    configuration = json.loads(parts["config.json"])
    edit(configuration["config"]["layers"])
    with zipfile.ZipFile(path, "w") as archive:
        for name, part in parts.items():
            archive.writestr(name, json.dumps(configuration) if name == "config.json" else part)


def system_as_layer(layers) -> None:
    layers[1] |= {"module": "os", "class_name": "system", "registered_name": None}


def system_as_activation(layers) -> None:
    layers[2]["config"]["activation"] = {"module": "os", "class_name": "function", "config": "system"}


def lambda_as_layer(layers) -> None:
    code = {"class_name": "__lambda__", "config": {"code": "4wE=", "defaults": None, "closure": None}}
    layers[1] |= {"class_name": "Lambda", "config": {"name": "touch", "function": code}}


@pytest.mark.parametrize("edit", [None, system_as_layer, system_as_activation, lambda_as_layer])
def test_model_with_code_in_it_is_refused_in_one_line(tmp_path, monkeypatch, edit):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "model.keras"
    plain = [keras.layers.Input((4, 6)), keras.layers.Flatten(), keras.layers.Dense(3)]
    if edit is None:  # as someone would make it
        plain[1:2] = [keras.layers.Lambda(lambda x: x[:, 0] * __import__("os").system("touch x"), output_shape=(6,))]
    model = keras.Sequential(plain)
    model.save(path)
    if edit is not None:
        assert apply_model(path, np.zeros((2, 4, 6))).shape == (2, 3)  # as it should be
        edited(path, edit)
    with pytest.raises(InputError) as error:
        apply_model(path, np.zeros((2, 4, 6)))
    assert str(error.value).startswith(f"{path}: not a readable Keras model (")
    assert len(str(error.value).splitlines()) == 1
    assert [entry.name for entry in tmp_path.iterdir()] == ["model.keras"]
