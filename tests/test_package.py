"""How the package is described, installed and layered: versions agree, imports point one way."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from configurations import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_version_is_the_same_everywhere():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    changes = re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert PROJECT["version"] == citation["version"] == changes[1]


def test_all_supported_pythons_are_tested():
    jobs = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text(encoding="utf-8"))["jobs"]
    supported = SpecifierSet(PROJECT["requires-python"])
    assert jobs["test"]["strategy"]["matrix"]["python"] == [f"3.{n}" for n in range(30) if f"3.{n}" in supported]


def test_hooks_use_the_pinned_versions():
    lines = (ROOT / "envs" / "requirements-test.txt").read_text(encoding="utf-8").splitlines()
    (hooks,) = (repo["hooks"] for repo in yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"])
    assert {Requirement(*hook["additional_dependencies"]).name for hook in hooks} == {"ruff", "snakefmt"}
    assert {pin for hook in hooks for pin in hook["additional_dependencies"]} <= set(lines)


def lint_imports(folder: Path) -> subprocess.CompletedProcess:
    """Check the import contracts of the project on the package in `folder`."""
    command = [Path(sys.executable).with_name("lint-imports"), ROOT / "pyproject.toml", "--no-cache", "--no-logo"]
    return subprocess.run(command, env={"PYTHONPATH": str(folder)}, cwd=folder, capture_output=True, text=True)


def test_imports_point_one_way():
    checked = lint_imports(ROOT / "scripts")
    assert checked.returncode == 0, checked.stdout
    assert f"Analyzed {len(list(ROOT.glob('scripts/slurrycast/**/*.py')))} files" in checked.stdout


@pytest.mark.parametrize(
    ("module", "imported"),
    [("data/frames", "dem.recipe"), ("analysis/rdf", "surrogates"), ("report/figures", "config.configuration")],
)
def test_an_import_that_points_another_way_is_noticed(tmp_path, module, imported):
    """Also one inside a function."""
    shutil.copytree(ROOT / "scripts" / "slurrycast", tmp_path / "slurrycast")
    with (tmp_path / "slurrycast" / f"{module}.py").open("a") as file:
        file.write(f"\n\ndef function():\n    import slurrycast.{imported}\n")
    checked = lint_imports(tmp_path)
    assert checked.returncode == 1
    assert f"slurrycast.{module.replace('/', '.')} -> slurrycast.{imported}" in checked.stdout


def test_the_package_never_imports_scripts():
    scripts = {path.stem for path in ROOT.glob("scripts/*/*.py")} - {"__init__"}
    imports = re.compile(r"^\s*(?:from|import) (\w+)", re.MULTILINE)
    modules = ROOT.glob("scripts/slurrycast/**/*.py")
    imported = {name for path in modules for name in imports.findall(path.read_text(encoding="utf-8"))}
    assert scripts
    assert imported & scripts == set()
