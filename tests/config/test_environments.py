"""The pinned environments in envs/ agree with each other."""

from collections import Counter

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from configurations import ROOT

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
