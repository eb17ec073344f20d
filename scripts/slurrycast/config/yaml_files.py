"""Configuration files and profiles as they were written, and what Snakemake drops or does not say when it reads them.

It reads a file as JSON if it can, else as YAML, always in UTF-8. Where a key stands twice in a section, the last one
wins without a word, and what it says of a file that it cannot read does not name the file. Files behind --configfile
are opened before the Snakefile: the profiles in profiles/, which are read earlier, call `refuse_bad_call`.
"""

import argparse
import json
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path

import yaml

from slurrycast.runtime.command_line import printable


class _Composer(yaml.SafeLoader):
    """Composes the nodes of a file, and notes each key that its section has already: (key, line, line of the first)."""

    def __init__(self, text: str):
        super().__init__(text)
        self.repeated: list[tuple[str, int, int]] = []

    def compose_mapping_node(self, anchor: str | None) -> yaml.MappingNode:
        node = super().compose_mapping_node(anchor)
        first_lines: dict[object, int] = {}
        for key_node, _ in node.value:
            line = key_node.start_mark.line + 1
            if key_node.tag == "tag:yaml.org,2002:merge":
                key = (key_node.tag,)  # equal to no key of the file itself
            else:
                try:
                    key = self.construct_object(key_node, deep=True)
                    hash(key)
                except (yaml.YAMLError, TypeError, ValueError):
                    continue  # no key of a Python dict, which Snakemake refuses
            if key in first_lines:  # equal keys may be written in two ways: a and "a", 1 and 1.0
                self.repeated.append((str(key_node.value), line, first_lines[key]))
            first_lines.setdefault(key, line)
        return node


def file_problems(path: str | Path) -> list[str]:
    """A line for each problem of a YAML or JSON file: no UTF-8, broken syntax, no keys, and every repeated key."""
    path = Path(path)
    name = printable(os.path.relpath(path) if path.is_relative_to(Path.cwd()) else str(path))
    if path.is_fifo() or path.is_char_device():  # it can be read once, which Snakemake does
        return []
    try:
        content = path.read_bytes()
    except OSError as error:
        return [f"{name}: cannot be read: {error.strerror}"]
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        return [f"{name} line {line}: byte 0x{content[error.start]:02x} is not UTF-8: must be saved as UTF-8"]
    try:
        json.loads(text)
        text = text.replace("\t", " ")  # which JSON has between its values only, and YAML not everywhere
    except (ValueError, RecursionError):
        pass
    try:
        composer = _Composer(text)
        root = composer.get_single_node()
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        return [f"{name} line {line}: character U+{error.character:04X}: must be text without control characters"]
    except yaml.MarkedYAMLError as error:
        what = ", ".join(filter(None, [error.context, error.problem]))
        return [f"{name} line {error.problem_mark.line + 1}: {what}: must be YAML or JSON"]
    except RecursionError:
        return [f"{name}: nested too deeply: must be YAML or JSON"]
    if not isinstance(root, yaml.MappingNode):
        return [f"{name}: no keys at the top level: must hold sections such as `run:`"]
    return [
        f"{name} line {line}: key {printable(key)} was given in line {first_line}: must be given once in a section"
        for key, line, first_line in sorted(composer.repeated, key=lambda repeated: repeated[1])
    ]


def refuse_bad_call(words: Sequence[str]) -> None:
    """End a call of snakemake with these words, with a line for each problem behind --configfile and --config.

    What other options take, Snakemake has read before it reads a profile.
    """
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--configfile", "--configfiles", nargs="+", type=Path, default=[])
    parser.add_argument("--config", "-C", nargs="*", default=[])
    called, _ = parser.parse_known_args(words)
    problems = [file_problems(file) for file in called.configfile]
    strays = [word for word in called.config if not re.match(r"[a-zA-Z_][\w-]*\w=", word)]  # Snakemake's own pattern
    lines = [line for lines_of_file in problems for line in lines_of_file]
    lines += [f"--config {printable(word)}: must be KEY=VALUE such as 'run={{name: x}}'" for word in strays]
    if any(problems[1:]) or any("=" not in word for word in strays):
        lines.append("--configfile and --config take several values: write targets before them, or `--` between")
    if lines:
        sys.exit("\n".join([*lines, "Nothing was run."]))
