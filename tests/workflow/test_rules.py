"""The rules as a reader sees them: each says what it does, and shares its name with its script and its log."""

import re
from pathlib import Path

import pytest
import yaml

from configurations import ROOT

FILES = [ROOT / "Snakefile", *sorted((ROOT / "workflow" / "rules").rglob("*.smk"))]


def rules() -> dict[str, str]:
    """Text of each rule by its name."""
    parts = [re.split(r"(?m)^ *rule (\w+):\n", path.read_text(encoding="utf-8"))[1:] for path in FILES]
    return {name: body for part in parts for name, body in zip(part[::2], part[1::2], strict=True)}


RULES = rules()
WITH_SCRIPT = {name: body for name, body in RULES.items() if "shell:" in body}


def test_every_script_has_a_rule():
    scripts = {path.stem for path in ROOT.glob("scripts/*/*.py") if path.parent.name != "slurrycast"}
    assert scripts == WITH_SCRIPT.keys()


@pytest.mark.parametrize("name", RULES)
def test_rule_says_in_one_line_what_it_does(name):
    assert re.match(r' +"""[A-Z][^\n"]+\."""\n', RULES[name])


@pytest.mark.parametrize("name", WITH_SCRIPT)
def test_script_log_and_cost_have_the_name_of_their_rule(name):
    body = WITH_SCRIPT[name]
    (script,) = re.findall(r'code\("(\w+/\w+)"|"scripts/(\w+/\w+)\.py"', body)
    assert Path("".join(script)).name == name
    assert (ROOT / "scripts" / f"{''.join(script)}.py").is_file()
    assert re.search(rf'f"\{{RESULTS\}}/logs/{name}(\.log|/[^"]*\.log)"', body)
    assert set(re.findall(r'cost=f"\{RESULTS\}/costs/(\w+)', body)) <= {name}


def test_rule_files_open_with_what_they_need_and_make():
    for path in FILES[1:]:
        text = path.read_text(encoding="utf-8")
        assert re.match(r'"""[^"]*\nREQUIRED INPUTS:\n[^"]*\nOUTPUTS:[^"]*"""\n', text), path


def test_the_cluster_starts_lammps_by_its_own_launcher_in_every_rule():
    profile = yaml.safe_load((ROOT / "profiles" / "slurm" / "profile.v9+.yaml").read_text(encoding="utf-8"))
    with_launcher = {name for name, resources in profile["set-resources"].items() if "mpi" in resources}
    assert with_launcher == {name for name, body in RULES.items() if "LAMMPS_JOB" in body}
