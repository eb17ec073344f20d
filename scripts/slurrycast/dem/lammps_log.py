"""LAMMPS logs: version, ranks and thermo table of a process, and whether it finished without error."""

import re
from dataclasses import dataclass
from math import prod
from pathlib import Path

import numpy as np

from slurrycast.runtime.files import RunError

END_MARKER = "Total wall time:"


@dataclass(frozen=True)
class Log:
    """One finished process. `columns` and `thermo` (rows, columns) are those of its last run."""

    version: str
    ranks: int
    columns: tuple[str, ...]
    thermo: np.ndarray


def thermo_row(line: str, columns: int) -> list[float] | None:
    """The numbers of a line of the thermo table, or None for any other line."""
    cells = line.split()
    if len(cells) != columns or not cells[0].isdecimal():
        return None
    try:
        return [float(cell) for cell in cells]
    except ValueError:
        return None


def read_log(path: str | Path) -> Log:
    """Read the log of a process that should have finished well.

    RunError, with LAMMPS' own message and the place of the log, if it holds an ERROR (lost particles are one), NaN or
    infinite thermo values, or lacks the end marker: the exit code alone does not show these.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise RunError(f"LAMMPS wrote no log: {error.strerror}; log: {path}") from error
    error = re.search(r"^ERROR.*", text, re.MULTILINE)
    if error:
        raise RunError(f"LAMMPS: {' '.join(error[0].split())}; log: {path}")
    columns: tuple[str, ...] = ()
    rows: list[list[float]] = []
    for line in text.splitlines():
        cells = line.split()
        if cells[:1] == ["Step"]:
            columns, rows = tuple(cells), []
        elif columns and (row := thermo_row(line, len(columns))):
            rows.append(row)
    thermo = np.array(rows).reshape(len(rows), len(columns))
    bad = ~np.isfinite(thermo).all(axis=1)
    if bad.any():
        raise RunError(f"LAMMPS: NaN or infinite values at step {thermo[bad][0, 0]:.0f}; log: {path}")
    if END_MARKER not in text:
        raise RunError(f"LAMMPS: the log ends without {END_MARKER!r}; the run was cut off; log: {path}")
    version = re.search(r"^LAMMPS \((.*?)\)", text, re.MULTILINE)
    grids = re.findall(r"(\d{1,9}) by (\d{1,9}) by (\d{1,9}) MPI processor grid", text)
    return Log(
        version=version[1] if version else "unknown",
        ranks=prod(map(int, grids[-1])) if grids else 0,
        columns=columns,
        thermo=thermo,
    )
