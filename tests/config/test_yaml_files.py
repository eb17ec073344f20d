"""Files of YAML and JSON: repeated keys and what cannot be read, each in a line with the file and its place."""

from pathlib import Path

import pytest

from configurations import ROOT
from slurrycast.config.yaml_files import file_problems, refuse_bad_call

ONCE, SYNTAX = "must be given once in a section", "must be YAML or JSON"
NO_KEYS = "own.yaml: no keys at the top level: must hold sections such as `run:`"


def repeated(key: str, line: int, first: int) -> str:
    return f"own.yaml line {line}: key {key} was given in line {first}: {ONCE}"


# content, its lines
FILES = {
    "run:\n  name: a\nslurries: s.tsv\nrun:\n  name: b\n": [repeated("run", 4, 1)],
    "surrogate:\n  vgg16:\n    epochs: 5\n    threads: 1\n    epochs: 2\n": [repeated("epochs", 5, 3)],
    "a: [{b: 1}, {b: 1, c: {d: 1,\n d: 2}}]\n": [repeated("d", 2, 1)],
    "a: 1\n'a': 2\n\"a\": 3\n": [repeated("a", 2, 1), repeated("a", 3, 1)],
    "1: a\n1.0: b\n0x1: c\n": [repeated("1.0", 2, 1), repeated("0x1", 3, 1)],
    "yes: 1\ntrue: 2\n": [repeated("true", 2, 1)],
    '{\n\t"run": {"name": "a"},\n\t"run": {"name": "b"}\n}\n': [repeated("run", 3, 2)],  # JSON
    "a: &x {b: 1}\nc:\n  <<: *x\n  b: 2\nd: *x\ne: {b: 1}\n": [],  # a merged key may be replaced
    "a: &x {b: 1}\nc:\n  <<: *x\n  <<: *x\n": [repeated("<<", 4, 3)],
    "a: &x\n  b: *x\n": [],
    "? [a, b]\n: 1\n": [],  # Snakemake refuses it
    "\ufeffrun: {name: a}\r\nslurries: s.tsv\r\n": [],
    "run:\n\tname: a\n": [
        "own.yaml line 2: while scanning for the next token, found character '\\t' that cannot start any token: "
        "must be YAML or JSON"
    ],
    "a: [1\nb: c: d\n": [
        f"own.yaml line 2: while parsing a flow sequence, expected ',' or ']', but got ':': {SYNTAX}",
    ],
    "a: 1\n---\na: 1\n": [
        f"own.yaml line 2: expected a single document in the stream, but found another document: {SYNTAX}"
    ],
    "a: *x\n": [f"own.yaml line 1: found undefined alias 'x': {SYNTAX}"],
    "a: 1\nb: \0\n": ["own.yaml line 2: character U+0000: must be text without control characters"],
    "[" * 10_000: [f"own.yaml: nested too deeply: {SYNTAX}"],
    "": [NO_KEYS],
    "# only a comment\n": [NO_KEYS],
    "- run\n": [NO_KEYS],
    "run\n": [NO_KEYS],
    "a: 1\n# größe\n".encode("latin-1"): ["own.yaml line 2: byte 0xf6 is not UTF-8: must be saved as UTF-8"],
    "a: 1\n".encode("utf-16"): ["own.yaml line 1: byte 0xff is not UTF-8: must be saved as UTF-8"],
}


@pytest.mark.parametrize(("content", "lines"), FILES.items(), ids=[str(content)[:30] for content in FILES])
def test_file(tmp_path, monkeypatch, content, lines):
    monkeypatch.chdir(tmp_path)
    Path("own.yaml").write_bytes(content if isinstance(content, bytes) else content.encode())
    assert file_problems(tmp_path / "own.yaml") == file_problems("own.yaml") == lines


def test_file_that_is_none(tmp_path):
    assert file_problems(tmp_path) == [f"{tmp_path}: cannot be read: Is a directory"]


def test_files_of_the_project_have_no_problems():
    folders = ["config", "envs", "profiles/*", "workflow/schemas", "tests/slurm", ".github/workflows"]
    paths = [path for folder in folders for path in ROOT.glob(f"{folder}/*.y*ml")]
    assert {"config.yaml", "ci.yml", "profile.v9+.yaml"} < {path.name for path in paths}
    assert [line for path in paths for line in file_problems(path)] == []


SEVERAL = "--configfile and --config take several values: write targets before them, or `--` between"
PAIR = "must be KEY=VALUE such as 'run={name: x}'"
# words behind snakemake, the lines
BAD_CALLS = {
    "--configfile good.yaml evaluation": ["evaluation: cannot be read: No such file or directory", SEVERAL],
    "--cores 2 --configfile none.yaml -n": ["none.yaml: cannot be read: No such file or directory"],
    "--configfile bad.yaml --cores 2": ["bad.yaml: no keys at the top level: must hold sections such as `run:`"],
    "--configfiles=.": [".: cannot be read: Is a directory"],
    "--configfile good.yaml frames.h5": ["frames.h5 line 1: byte 0x89 is not UTF-8: must be saved as UTF-8", SEVERAL],
    "--config run={} slurries": [f"--config slurries: {PAIR}", SEVERAL],
    "-C run.name=x": [f"--config run.name=x: {PAIR}"],
    "-C a=1": [f"--config a=1: {PAIR}"],
}
GOOD_CALLS = ["", "evaluation --configfile good.yaml", "--configfile good.yaml good.yaml -n evaluation"]
GOOD_CALLS += ["--configfile good.yaml -- evaluation", "-C run={} n-1= --cores 2", "--configfile /dev/null"]


def test_words_behind_snakemake(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("good.yaml").write_text("run: {name: a}\n")
    Path("bad.yaml").touch()
    Path("frames.h5").write_bytes(b"\x89HDF")
    for call in GOOD_CALLS:
        refuse_bad_call(call.split())
    for call, lines in BAD_CALLS.items():
        with pytest.raises(SystemExit) as end:
            refuse_bad_call(call.split())
        assert end.value.code == "\n".join([*lines, "Nothing was run."]), call
