"""Small made-up structures for tests: particles, frames in a box about the origin, frame stores and training sets."""

from pathlib import Path

import numpy as np

from slurrycast.data.dataset import TrainingSet, split
from slurrycast.data.features import FEATURE_NAMES
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


def random_particles(n: int) -> Particles:
    """Particles of four types in two phases, `n` a multiple of four."""
    rng = np.random.default_rng(1)
    types, phase, size_class = np.repeat([1, 2, 3, 4], n // 4), np.repeat([1, 2], n // 2), np.tile([1, 2], n // 2)
    return Particles(np.arange(1, n + 1), types, phase, size_class, rng.random(n), rng.random(n), ("BDPD", "8YSZ"))


def random_frame(number: int, n: int) -> Frame:
    """Frame whose quantities have nothing to do with each other."""
    rng = np.random.default_rng(number)
    position_um, scaled, contacts = rng.normal(size=(n, 3)), rng.normal(size=(n, 3)), rng.integers(0, 9, n, np.int32)
    return Frame(number, 50 * number, 0.1 * number, position_um, scaled, contacts, -rng.random(3), 1 + rng.random(3))


def training_set(
    features: np.ndarray, targets: np.ndarray, edges_um: np.ndarray, final_edges_um: np.ndarray, share: float = 0.2
) -> TrainingSet:
    """Samples (n, frames, 6), targets (n, 3) and edges (slurries, frames, 3), those of the targets (slurries, 3)."""
    (n, n_frames, _), n_slurries = features.shape, len(edges_um)
    return TrainingSet(
        features=features,
        targets=targets,
        slurry_index=np.repeat(np.arange(n_slurries), n // n_slurries),
        slurries=tuple(f"T{number + 1}" for number in range(n_slurries)),
        particle_id=np.tile(np.arange(1, n // n_slurries + 1), n_slurries),
        is_validation=split(n, share, seed=1),
        feature_names=FEATURE_NAMES,
        input_frames=tuple(range(11 - n_frames, 11)),
        target_frame=120,
        input_edges_um=edges_um,
        target_edges_um=final_edges_um,
    )
