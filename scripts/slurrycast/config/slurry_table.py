"""The slurry table: one row for each slurry, checked against workflow/schemas/slurries.schema.yaml."""

import csv
import dataclasses
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from slurrycast.config.schema_errors import ROOT, schema, schema_errors, shown
from slurrycast.runtime.files import PASSED_OVER


@dataclasses.dataclass(frozen=True)
class Slurry:
    """A row of the slurry table, or a run that follows from one; `dem` then holds the settings in which it differs."""

    id: str
    role: str
    mass_units: float  # in formulation.unit_mass_pg
    thickness_ratio: float  # Lz / Lx
    seed: int
    formulation: str = ""  # name of its recipe in `formulations`; empty: the default one
    dem: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def row(self) -> dict[str, str | float]:
        """Cells of its row in a slurry table."""
        return {name: value for name, value in dataclasses.asdict(self).items() if name != "dem"}


def cell_value(text: str, rule: Mapping) -> str | int | float:
    """The value of a cell; text that is no number stays text, which the schema then refuses."""
    try:
        if rule["type"] == "integer" and re.fullmatch(r"[-+]?\d+", text, re.ASCII):
            return int(text)
        if rule["type"] == "number" and re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", text, re.ASCII):
            return float(text)
    except ValueError:  # thousands of digits
        pass
    return text


def table_file(path: str | Path) -> Path:
    """Path of a table that a user names, from the working directory, or else of the project where that has it."""
    try:
        is_elsewhere = not Path(path).exists() and (ROOT / path).exists()
    except OSError:  # such as a name too long: reading it says so
        is_elsewhere = False
    return Path(os.path.relpath(ROOT / path) if is_elsewhere else path)


def read_cells(path: str | Path, delimiter: str) -> tuple[list[tuple[int, list[str]]], list[str]]:
    """Cells of a table that a user wrote.

    A relative path starts at the working directory. Where there is no such file it starts at the project, since the
    shipped configurations name tables of the project and can be used from any folder.

    Parameters
    ----------
    path, delimiter
        The table, and what separates its cells: a tab or a comma.

    Returns
    -------
    The number of each line that is not empty and its cells; and a line for the problem, if there is one.
    """
    try:
        # utf-8-sig: spreadsheet programs put a byte order mark in front
        text = table_file(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        folders = [str(folder) for folder in dict.fromkeys((Path.cwd(), ROOT))]
        searched = f"neither in {folders[0]} nor in {folders[1]}" if len(folders) > 1 else f"not in {folders[0]}"
        return [], [f"{path}: cannot be read: {error.strerror if Path(path).is_absolute() else searched}"]
    except (OSError, ValueError) as error:
        return [], [f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}"]
    reader = csv.reader(text.splitlines(), delimiter=delimiter)
    try:
        return [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(map(str.strip, row))], []
    except csv.Error as error:
        kind = "tabs" if delimiter == "\t" else "commas"
        return [], [f"{path} line {reader.line_num}: {error}: must be cells separated by {kind}"]


def read_slurry_table(path: str | Path) -> tuple[list[Slurry], list[str]]:
    """Read the slurry table at `path`: its good rows, and a line for each problem."""
    rows, lines = read_cells(path, "\t")
    if lines:
        return [], lines
    columns, required = (schema("slurries")[key] for key in ("properties", "required"))
    names = rows[0][1] if rows else []
    if len({*names}) < len(names) or not {*required} <= {*names} <= {*columns}:
        first_line = shown("\t".join(names)) if rows else "nothing"
        optional = ", ".join(name for name in columns if name not in required)
        must_be = f"must be the columns {', '.join(required)}, and {optional} if you like, separated by tabs"
        return [], [f"{path} line 1: {first_line}: {must_be}"]
    (_, header), *body = rows
    slurries, lines = [], []
    seen: dict[tuple[str, Any], int] = {}
    for number, cells in body:
        place = f"{path} line {number}"
        if len(cells) != len(header):
            lines.append(f"{place}: {len(cells)} cells: must be {len(header)}, separated by tabs")
            continue
        row = {name: cell_value(cell, columns[name]) for name, cell in zip(header, cells, strict=True)}
        errors = schema_errors(row, schema("slurries"), hint=lambda *_: "")  # YAML does not read a cell
        wrong = [f"{place}: {column} = {what}" for column, what in errors]
        for column in ("id", "seed"):
            first = seen.setdefault((column, row[column]), number)
            if first != number:
                wrong.append(f"{place}: {column} = {shown(row[column])}: must differ from line {first}")
        if not wrong and PASSED_OVER.fullmatch(row["id"]):
            wrong.append(f"{place}: id = {shown(row['id'])}: must not be logs, begin with work or end with _work")
        lines += wrong
        if not wrong:
            slurries.append(Slurry(**row))
    if not body:
        lines.append(f"{path}: no slurries: must be at least one row below the column names")
    return slurries, lines
