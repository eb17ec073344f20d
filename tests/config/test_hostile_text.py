"""Text that a shell, a formatter or a terminal would take for more than text, in the configuration and the table."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from configurations import HEADER, merged, nested
from slurrycast.config.configuration import check
from slurrycast.config.schema_errors import schema

pytestmark = pytest.mark.usefixtures("in_empty_project")

HOSTILE = [
    *("$(touch x)", "`touch x`", "; touch x", "x; rm -rf .", "| touch x", "&& touch x", "> x", "a b", " ", "*", "~"),
    *("it's", '"quoted"', "back\\slash", "two\nlines", "tab\there", "\x1b[2J", "nul\0", "größe", "\ud800", "x" * 5000),
    *("--help", "-x", "../x", "/x", "{slurry}", "{config}", "{{x}}", "%s", "${HOME}", "__import__('os')", ""),
]
LEGAL = {"run.name": {"--help", "-x"}}  # as a name behind results/
# What may be any text, since it is a path or a command; that it stays quoted is tested in workflow/test_quoting.py.
ANY_TEXT = {"slurries", "dem.executable", "dem.launcher", "surrogate.models.vgg16", "explore.recipes"}


def texts(rule: dict, path: str = "") -> Iterator[str]:
    """Paths of all keys whose value is text; `[]` of an item of a list, `<name>` of a key that one may choose."""
    if rule["type"] == "object":
        for key, item in rule.get("properties", {}).items():
            yield from texts(item, f"{path}.{key}".lstrip("."))
        for item in rule.get("patternProperties", {}).values():
            yield f"{path}.<name>"
            yield from texts(item, f"{path}.{'vgg16' if path == 'surrogate.models' else 'NiO'}")
    elif rule["type"] == "array":
        yield from texts(rule["items"], f"{path}[]")
    elif "string" in rule["type"]:
        yield path


TEXTS = list(texts(schema("config")))


def test_all_texts_are_found():
    expected = {*ANY_TEXT, "run.name", "formulation.phases.<name>", "surrogate.names[]", "evaluation.replicated[]"}
    assert expected < set(TEXTS)


@pytest.mark.parametrize("path", TEXTS)
def test_hostile_text_is_refused_or_may_be_any_text(config, path):
    passed = set()
    for text in HOSTILE:
        section = path.removesuffix(".<name>")
        if section != path:
            override = nested(
                section, {text: config["formulation"]["phases"]["NiO"] if "phases" in path else "m.keras"}
            )
        else:
            override = nested(path.removesuffix("[]"), [text] if path.endswith("[]") else text)
        lines = check(merged(config, override))
        assert all(line.isprintable() for line in lines), lines
        if not lines:
            passed.add(text)
    assert passed <= LEGAL.get(path, set()) or path in ANY_TEXT


@pytest.mark.parametrize("column", ["id", "role"])
def test_hostile_text_in_the_slurry_table_is_refused(config, column):
    for text in set(HOSTILE) - {'"quoted"'}:  # quotes around a cell are taken off
        names = [text, "test"] if column == "id" else ["A", text]
        table = HEADER + "\t".join([*names, "1", "1", "1"]) + "\nB\ttrain\t1\t1\t2\n"
        Path("s.tsv").write_text(table, encoding="utf-8", errors="surrogateescape" if text != "\ud800" else "replace")
        lines = check(config | {"slurries": "s.tsv"})
        assert lines, text
        assert all(line.isprintable() for line in lines), lines
