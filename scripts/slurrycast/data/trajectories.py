"""Whole slurries for surrogates that learn from neighbours: particles and some of their frames, slurry by slurry."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slurrycast.data.frames import Frame, Particles, read_frames
from slurrycast.runtime.files import InputError


@dataclass(frozen=True)
class Trajectory:
    """One slurry: its particles, frames by their numbers, and box edges (3,) in um of all frames, read or not."""

    slurry: str
    particles: Particles
    frames: Mapping[int, Frame]
    edges_um: Mapping[int, np.ndarray]


def read_trajectories(
    paths: Iterable[str | Path], needed: Callable[[Mapping[int, np.ndarray]], Sequence[int]]
) -> list[Trajectory]:
    """Read some frames of several slurries.

    Parameters
    ----------
    paths
        Frame stores.
    needed
        Given the box edges (3,) in um by frame number, it returns the numbers of the frames that are read.

    Raises
    ------
    InputError
        If a frame is not there, or the phases differ from those of the first slurry.
    """
    slurries = []
    for path in paths:
        with read_frames(path) as store:
            edges_um = dict(zip(store.frame_numbers.tolist(), store.all_edges_um(), strict=True))
            frames = {number: store.frame(number) for number in sorted(needed(edges_um))}
            slurries.append(Trajectory(str(store.attributes["slurry"]), store.particles, frames, edges_um))
        first, names = slurries[0], slurries[-1].particles.phase_names
        if names != first.particles.phase_names:
            expected = ", ".join(first.particles.phase_names)
            raise InputError(f"{path}: has the phases {', '.join(names)}, slurry {first.slurry} has {expected}")
    return slurries
