"""LAMMPS data files, read by other code than that of the package."""

from pathlib import Path

import numpy as np


def atoms(path: Path) -> np.ndarray:
    """Rows id, type, diameter, density, x, y, z and, if they are there, image flags, sorted by id."""
    lines = path.read_text().splitlines()
    start = lines.index("Atoms # sphere") + 2
    count = next(int(line.split()[0]) for line in lines if line.endswith(" atoms"))
    rows = np.array([line.split() for line in lines[start : start + count]], dtype=float)
    return rows[np.argsort(rows[:, 0])]


def bounds_um(path: Path) -> np.ndarray:
    """Lower and upper bound of the box on each axis (3, 2)."""
    lines = path.read_text().splitlines()
    return np.array([line.split()[:2] for line in lines if line.endswith("hi")], dtype=float)
