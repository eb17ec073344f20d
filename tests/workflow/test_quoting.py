"""Nothing of a configuration reaches a shell as more than text."""

import json
import os
import shutil
import zipfile

import pytest
import yaml

from checkouts import copy_checkout, snakemake
from configurations import load

TEXT = (
    "$(touch x) `touch x`; touch x | touch x & touch x > x * ~ it's \"a\" 'b c' \\ größe {slurry} {config} %s ${HOME}'"
)
MODEL = TEXT.translate({ord(brace): "_" for brace in "{}"})  # Snakemake would take them for wildcards


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A checkout with a slurry table and a model, all under names that a shell would run."""
    folder = copy_checkout(tmp_path_factory.mktemp("folder") / "a pröject's $(touch x); touch x")
    shutil.copy(folder / "config" / "slurries_tiny.tsv", folder / f"{TEXT}.tsv")
    (folder / f"{TEXT}.yaml").write_text("{}\n")
    said = ("Massively Parallel Simulator - 2 Aug 2023", "ERROR: started as one program")  # with -h and without
    (folder / TEXT).write_text(
        f"#!/bin/sh\nfor last; do :; done\n[ $last = -h ] && exec echo '{said[0]}'\nexec echo '{said[1]}'\n"
    )
    (folder / TEXT).chmod(0o755)
    layer = {"class_name": "InputLayer", "config": {"name": "features", "batch_shape": [None, 4, 6]}}
    with zipfile.ZipFile(folder / f"{MODEL}.keras", "w") as archive:
        archive.writestr("config.json", json.dumps({"config": {"layers": [layer]}}))
    return folder


@pytest.mark.parametrize(("ranks", "program"), [(1, "executable"), pytest.param(2, "launcher", marks=pytest.mark.slow)])
def test_hostile_texts_stay_text(project, monkeypatch, ranks, program):
    """Every key that may be any text (test_hostile_text.ANY_TEXT), through jobs that are really run.

    And the command line with which Snakemake was started, which is recorded.
    """
    dem = {"executable": "lmp", "launcher": TEXT, "ranks": ranks} | {program: TEXT}
    monkeypatch.setenv("PATH", os.pathsep.join([str(project), os.environ["PATH"]]))
    name = f"ranks_{ranks}"
    config = load("tiny") | {"run": {"name": name}, "slurries": f"{TEXT}.tsv"}
    config["dem"] |= dem
    config["surrogate"] |= {"models": {"vgg16": f"{MODEL}.keras"}, "names": ["vgg16"]}
    (project / "hostile.yaml").write_text(yaml.safe_dump(config, allow_unicode=True), encoding="utf-8")
    results = project / "results" / name
    targets = [f"results/{name}/{file}" for file in ("config.yaml", "models/vgg16/model.keras", "dem/1/run.json")]
    said = snakemake(project, "--keep-going", *targets, "--configfile", "hostile.yaml", f"{TEXT}.yaml", fails=True)
    assert "error: LAMMPS: ERROR: started as one program" in said
    assert "Traceback" not in said
    recorded = yaml.safe_load((results / "config.yaml").read_text(encoding="utf-8"))
    assert {key: recorded["dem"][key] for key in dem} == dem
    assert recorded["slurries"] == f"{TEXT}.tsv"
    assert (results / "models" / "vgg16" / "model.keras").read_bytes() == (project / f"{MODEL}.keras").read_bytes()
    assert json.loads((results / "dem" / "1" / "inputs.json").read_text())["slurry"] == "1"
    command = json.loads((results / "versions.json").read_text(encoding="utf-8"))["command"]
    assert "touch x" in command and "größe" in command
    assert [path for path in project.parent.rglob("*") if path.name == "x"] == []
