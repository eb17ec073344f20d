"""Whether a LAMMPS is new enough, and has what the scripts in scripts/lammps use."""

import re

import pytest

from configurations import ROOT
from slurrycast.runtime.lammps_help import STYLES, LammpsHelp, ask
from slurrycast.runtime.programs import Launcher


def help_text(version: str, without: str = "") -> str:
    """What `lmp -h` says, in short."""
    lists = (f"* {kind.capitalize()} styles:\n\n{'  '.join(styles)}  other\n" for kind, styles in STYLES.items())
    text = f"\nLarge-scale Atomic/Molecular Massively Parallel Simulator - {version}\n\n" + "\n".join(lists)
    return text.replace(f" {without} ", " ") if without else text


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (help_text("2 Aug 2023"), None),
        (help_text("29 Aug 2024 - Update 3"), None),
        (help_text("10 Dec 2025 - Development"), None),
        (help_text("of our site"), None),
        ("", None),
        (help_text("23 Jun 2022 - Update 4"), "is LAMMPS 23 Jun 2022 - Update 4: must be 2 Aug 2023 or newer"),
        (help_text("1 Aug 2023"), "is LAMMPS 1 Aug 2023: must be 2 Aug 2023 or newer"),
        (
            help_text("2 Aug 2023", without="gran/hertz/history"),
            "lacks pair style gran/hertz/history: must have the package GRANULAR",
        ),
        (help_text("2 Aug 2023").replace("contact/atom", "contact/atom/of/others"), "lacks compute style contact/atom"),
    ],
)
def test_problem_is_named(text, problem):
    found = LammpsHelp("my lmp", text).problem()
    if problem is None:
        assert found is None
    else:
        assert found.startswith(f"dem.executable: 'my lmp' {problem}")


@pytest.mark.parametrize("ranks", [1, 2])
def test_lammps_of_the_environment_is_fit(ranks):
    said = ask(Launcher("lmp", "mpiexec", ranks))
    assert said.problem() is None
    assert "* Pair styles:" in said.text and len(re.findall("Massively Parallel", said.text)) == 1


def test_styles_are_those_of_the_scripts():
    text = "\n".join(path.read_text() for path in (ROOT / "scripts" / "lammps").glob("*.lmp")).replace("&\n", "")
    found = {"atom": set(re.findall(r"^atom_style +(\S+)", text, re.MULTILINE))}
    found["minimize"] = set(re.findall(r"^min_style +(\S+)", text, re.MULTILINE))
    pairs = re.findall(r"^pair_style +(.*)", text, re.MULTILINE)
    found["pair"] = {word for line in pairs for word in line.split() if re.match(r"[a-z]", word)}
    for kind in ("fix", "compute", "dump"):
        found[kind] = set(re.findall(rf"^{kind} +\S+ +\S+ +(\S+)", text, re.MULTILINE))
    assert found == {kind: set(styles) for kind, styles in STYLES.items()}
