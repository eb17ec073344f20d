"""Whether a LAMMPS is new enough, and has what the scripts in scripts/lammps use."""

import re
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from configurations import ROOT, load
from slurrycast.dem.lammps_run import force_field_variables
from slurrycast.runtime import lammps_help
from slurrycast.runtime.files import InputError
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
        (help_text("patch_10Dec2025-77-g1a2b3c4"), None),
        (help_text("unknown - 10 Dec 2025").replace("Simulator - ", "Simulator "), None),
        (help_text("of our site"), "is LAMMPS of version 'of our site', without a date: must be 2 Aug 2023 or newer"),
        ("Massively Parallel Simulator", "is LAMMPS of version 'unknown', without a date"),
        ("", "does not answer -h as LAMMPS does: it printed nothing"),
        ("-h\n\n", "does not answer -h as LAMMPS does: -h"),
        (help_text("3Mar2020"), "is LAMMPS 3Mar2020: must be 2 Aug 2023 or newer"),
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
    found = LammpsHelp(Launcher("my lmp", "", 1), text).problem()
    if problem is None:
        assert found is None
    else:
        assert found.startswith(f"dem.executable: 'my lmp' {problem}")


@pytest.fixture
def program(tmp_path) -> Callable[[str], str]:
    """Write a shell script that stands for a program; return its path."""

    def write(text: str) -> str:
        path = tmp_path / "program"
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)
        return str(path)

    return write


@pytest.mark.parametrize(
    ("launcher", "says"),
    [
        ("env -n", "-h ended with exit code 125: "),
        ("mpiexec --nosuch", "-h ended with exit code "),
        ("true", "does not answer -h as LAMMPS does: it printed nothing"),
        ("echo -n", "does not answer -h as LAMMPS does: 2 /"),
        ("", None),
        ("mpiexec '", None),
    ],
)
def test_launcher_that_fails_is_named(launcher, says):
    with pytest.raises(InputError) as error:
        raise InputError(str(ask(Launcher("lmp", launcher, 2)).problem()))
    expected = f"dem.launcher: {launcher!r} "
    expected += f"with dem.executable 'lmp' {says}" if says else "is no command; give a program, with options if it"
    assert str(error.value).startswith(expected)


def test_lammps_that_does_not_answer_is_ended_with_all_that_it_started(program, monkeypatch):
    monkeypatch.setattr(lammps_help, "PATIENCE_S", 0.5)
    executable = program("sleep 61.5 &\nsleep 61.5")
    with pytest.raises(InputError) as error:
        ask(Launcher(executable, "", 1))
    assert str(error.value) == f"dem.executable: {executable!r} -h gave no answer in 0.5 s"
    time.sleep(0.1)
    assert not [child for child in psutil.process_iter(["cmdline"]) if child.info["cmdline"] == ["sleep", "61.5"]]


def test_program_that_cannot_be_started_is_named(program):
    executable = program("")
    Path(executable).write_text("no program")
    with pytest.raises(InputError, match=r"dem.executable: '.*' cannot be started: Exec format error$"):
        ask(Launcher(executable, "", 1))


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
    contacts = force_field_variables(load("config"))["contact_styles"]
    words = " ".join([*pairs, contacts]).split()
    found["pair"] = {word for word in words if re.match(r"[a-z]", word)}
    for kind in ("fix", "compute", "dump"):
        found[kind] = set(re.findall(rf'(?:^|"){kind} +\S+ +\S+ +(\S+)', text, re.MULTILINE))
    assert found == {kind: set(styles) for kind, styles in STYLES.items()}
