"""LAMMPS text dumps of a slurry: read frame by frame in float64, and refused where they are cut off or mixed up."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from slurrycast.data.frames import Frame
from slurrycast.runtime.files import InputError

COLUMNS = ("id", "type", "radius", "xu", "yu", "zu", "xsu", "ysu", "zsu", "c_contacts")


@dataclass(frozen=True)
class DumpFrame:
    """One frame: box corner and edges (3,) in um, `values` (n, 10) in the order of COLUMNS, sorted by id."""

    step: int
    lower_um: np.ndarray
    edges_um: np.ndarray
    values: np.ndarray


def as_frame(frame: DumpFrame, number: int, timestep_us: float) -> Frame:
    """A dump frame as frame `number` of the store; its time is that of its step."""
    return Frame(
        number=number,
        step=frame.step,
        time_us=frame.step * timestep_us,
        position_um=frame.values[:, 3:6],
        scaled_position=frame.values[:, 6:9],
        coordination=frame.values[:, 9].astype(np.int32),
        lower_um=frame.lower_um,
        edges_um=frame.edges_um,
    )


class _Lines:
    """Lines of a file with their number, and errors that say where."""

    def __init__(self, path: Path, lines: Iterator[str]) -> None:
        self.path, self.lines, self.number, self.frame = path, lines, 0, 0

    def error(self, what: str) -> InputError:
        return InputError(f"{self.path}: frame {self.frame}, line {self.number}: {what}")

    def next(self) -> str:
        self.number += 1
        line = next(self.lines, "")
        if not line.endswith("\n"):
            raise self.error("the file ends inside the frame")
        return line.strip()

    def expect(self, start: str) -> str:
        line = self.next()
        if not line.startswith(start):
            raise self.error(f"{line[:60]!r} in place of {start!r}")
        return line[len(start) :].strip()

    def table(self, rows: int, columns: int) -> np.ndarray:
        """Read `rows` lines of `columns` finite numbers each."""
        first = self.number + 1
        block = list(islice(self.lines, rows))
        self.number += len(block)
        if len(block) < rows or not block[-1].endswith("\n"):
            raise self.error(f"the file ends inside the frame, after {len(block)} of {rows} rows")
        try:
            values = np.loadtxt(block, comments=None, ndmin=2)
        except ValueError:
            values = None
        if values is None or values.shape != (rows, columns) or not np.isfinite(values).all():
            self.number = first + next(i for i, line in enumerate(block) if not _is_row(line, columns))
            raise self.error(f"{block[self.number - first].strip()[:60]!r} is no row of {columns} finite numbers")
        return values


def _is_row(line: str, columns: int) -> bool:
    try:
        # As for the whole table: float() accepts more, such as 1_0.
        values = np.loadtxt([line], comments=None) if line.strip() else np.empty(0)
    except ValueError:
        return False
    return values.shape == (columns,) and bool(np.isfinite(values).all())


def read_dump(path: str | Path) -> Iterator[DumpFrame]:
    """Yield the frames of a dump with the columns COLUMNS, sorted by id, one at a time.

    InputError, with file, frame (counted from 0) and line, for a file that is cut off, holds other columns, or mixes
    runs: steps that do not grow, another number of particles, other ids, types or radii than the first frame.
    """
    path = Path(path)
    with path.open(encoding="ascii", errors="replace") as file:
        lines = _Lines(path, iter(file))
        first: DumpFrame | None = None
        last_step = -1
        while True:
            head = next(lines.lines, None)
            if head is None:
                break
            lines.number += 1
            if head.strip() != "ITEM: TIMESTEP":
                raise lines.error(f"{head.strip()[:60]!r} in place of 'ITEM: TIMESTEP'")
            step = _whole(lines)
            if step <= last_step:
                raise lines.error(f"step {step} after step {last_step}: frames of different runs or in disorder")
            lines.expect("ITEM: NUMBER OF ATOMS")
            count = _whole(lines)
            if count == 0:
                raise lines.error("a frame without particles")
            lines.expect("ITEM: BOX BOUNDS pp pp pp")
            bounds = lines.table(3, 2)
            empty = bounds[:, 0] >= bounds[:, 1]
            if empty.any():
                lines.number += int(np.argmax(empty)) - 2
                raise lines.error("the upper bound of the box does not exceed the lower one")
            columns = tuple(lines.expect("ITEM: ATOMS").split())
            if columns != COLUMNS:
                raise lines.error(f"columns {' '.join(columns)} in place of {' '.join(COLUMNS)}")
            if first is not None and count != len(first.values):
                raise lines.error(f"{count} particles after {len(first.values)} in the first frame")
            start = lines.number
            values = lines.table(count, len(COLUMNS))
            if first is None and (np.diff(values[:, 0]) <= 0).any():
                raise lines.error("particles are not sorted by id, or an id stands twice")
            frame = DumpFrame(step, bounds[:, 0], bounds[:, 1] - bounds[:, 0], values)
            first = first or frame
            changed = (values[:, :3] != first.values[:, :3]).any(axis=1)
            if changed.any():
                lines.number = start + 1 + int(np.argmax(changed))
                raise lines.error("id, type or radius differ from those of the first frame")
            yield frame
            last_step = step
            lines.frame += 1
    if first is None:
        raise InputError(f"{path}: holds no frame")


def _whole(lines: _Lines) -> int:
    text = lines.next()
    if not text.isdecimal() or len(text) > 18:  # what an int64 holds
        raise lines.error(f"{text[:60]!r} is no whole number")
    return int(text)
