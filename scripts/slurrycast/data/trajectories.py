"""Whole slurries for surrogates that learn from neighbours: particles and some of their frames, slurry by slurry."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slurrycast.data.frames import Frame, Particles, read_frames


@dataclass(frozen=True)
class Trajectory:
    """One slurry: its particles, frames by their numbers, and box edges (3,) in um of all frames, read or not."""

    slurry: str
    particles: Particles
    frames: Mapping[int, Frame]
    edges_um: Mapping[int, np.ndarray]


def read_trajectories(
    paths: Iterable[str | Path],
    needed: Callable[[Mapping[int, np.ndarray]], Sequence[int]],
    phases: Sequence[str],
) -> list[Trajectory]:
    """Read some frames of several slurries.

    Parameters
    ----------
    paths
        Frame stores.
    needed
        Given the box edges (3,) in um by frame number, it returns the numbers of the frames that are read.
    phases
        Names of the phases of all slurries, in the order of their numbers.

    Raises
    ------
    InputError
        If a frame is not there, or a slurry has another phase.
    """
    slurries = []
    for path in paths:
        with read_frames(path) as store:
            edges_um = dict(zip(store.frame_numbers.tolist(), store.all_edges_um(), strict=True))
            frames = {number: store.frame(number) for number in sorted(needed(edges_um))}
            particles = store.particles_of(phases)
            slurries.append(Trajectory(str(store.attributes["slurry"]), particles, frames, edges_um))
    return slurries
