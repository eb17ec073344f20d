"""Small made-up structures for tests: particles, frames in a box about the origin, and frame stores."""

from pathlib import Path

import numpy as np

from slurrycast.data.frames import Frame, Particles, write_frames


def particles(
    phase: np.ndarray, radius_um: float | np.ndarray = 0.4, names: tuple[str, ...] = ("NiO",), mass_pg: float = 2.0
) -> Particles:
    """Particles of these phases (n,), from 1, with one size class and type each."""
    n = len(phase)
    ones = np.ones(n, dtype=int)
    radius_um, mass_pg = (np.broadcast_to(value, n) for value in (radius_um, mass_pg))
    return Particles(np.arange(1, n + 1), phase, phase, ones, radius_um, mass_pg, names)


def frame(
    number: int, position_um: np.ndarray, edges_um: np.ndarray, spread_um: np.ndarray | None = None, step: int = 1
) -> Frame:
    """Frame with positions (n, 3), without contacts, at the time of its number in us."""
    position_um = np.asarray(position_um, dtype=float)
    box = (-edges_um / 2, edges_um)
    scaled = position_um / edges_um + 0.5
    return Frame(number, step, float(number), position_um, scaled, np.zeros(len(position_um)), *box, spread_um)


def write_store(path: Path, frames: list[Frame], some: Particles | None = None, **attributes: str) -> Path:
    """Write a frame store, of particles of one phase unless there are `some`."""
    if some is None:
        some = particles(np.ones(len(frames[0].position_um), dtype=int))
    write_frames(path, some, frames, attributes)
    return path
