"""Writes the generated part of config/README.md, the reference of all keys: python -m slurrycast.config.reference."""

import json
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import yaml

from slurrycast.config.schema_errors import ROOT, allowed, schema

GENERATED = "<!-- Below this line: written by PYTHONPATH=scripts python -m slurrycast.config.reference -->\n"


def _default(value: Any, path: Sequence[str]) -> str:
    """The value at `path` of the shipped configuration; `*` takes all items of a mapping or list."""
    if not path:
        return str(value) if isinstance(value, str) else json.dumps(value)
    key, *rest = path
    if key != "*":
        return _default(value[key], rest)
    items = value.values() if isinstance(value, Mapping) else value
    return ("; " if "*" in rest else ", ").join(_default(item, rest) for item in items) or "none"


def _rows(rule: Mapping, default: Any, name: str = "", path: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield a row of the reference for each key below `rule`."""
    for key, item in rule.get("properties", {}).items():
        yield from _row(item, default, f"{name}.{key}".lstrip("."), (*path, key))
    for item in rule.get("patternProperties", {}).values():
        yield from _row(item, default, f"{name}.<{rule['each']}>", (*path, "*"))


def _row(rule: Mapping, default: Any, name: str, path: tuple[str, ...]) -> Iterator[str]:
    if "same_as" in rule:
        yield f"| `{name}` | {rule.get('unit', '')} | As `{rule['same_as']}`. | {allowed(rule)} | |"
    elif rule["type"] == "object":
        yield from _rows(rule, default, name, path)
    elif rule["type"] == "array" and rule["items"]["type"] == "object":
        yield from _rows(rule["items"], default, f"{name}[]", (*path, "*"))
    else:
        cells = [f"`{name}`", rule.get("unit", ""), rule["description"], allowed(rule)]
        if default is not None:
            cells.append(f"`{_default(default, path)}`")
        yield "| " + " | ".join(cells) + " |"


def reference() -> str:
    """The generated part of config/README.md: each key of the configuration and each column of the slurry table."""
    default = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    text = "\n## Keys\n\nEvery key is required, but for those of a pair in `force_field.pairs` and of a recipe in\n"
    text += "`formulations`. The last column is `config.yaml`, the demo scale.\n"
    head = "| key | unit | meaning | allowed | demo |\n|---|---|---|---|---|\n"
    for key, rule in schema("config")["properties"].items():
        text += f"\n### `{key}`\n\n" + (
            textwrap.fill(rule["description"], 120) + "\n\n" if {"properties", "patternProperties"} & {*rule} else ""
        )
        text += head + "\n".join(_row(rule, default, key, (key,))) + "\n"
    text += "\n## Columns of the slurry table\n\n| column | unit | meaning | allowed |\n|---|---|---|---|\n"
    return text + "\n".join(_rows(schema("slurries"), None)) + "\n"


def main() -> None:
    """Write the generated part of config/README.md anew."""
    path = ROOT / "config" / "README.md"
    written_by_hand, marker, _ = path.read_text(encoding="utf-8").partition(GENERATED)
    path.write_text(written_by_hand + (marker or GENERATED) + reference(), encoding="utf-8")


if __name__ == "__main__":
    main()
