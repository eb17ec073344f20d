"""What a surrogate learns from that sees a slurry as a whole: particles and some of their frames, slurry by slurry."""

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
    """Read those frames from frame stores whose numbers `needed` gives for the box edges (3,) in um at each frame.

    InputError if one of them is not there, and for phases that differ from those of the first slurry.
    """
    slurries = []
    for path in paths:
        with read_frames(path) as store:
            edges_um = dict(zip(store.frame_numbers.tolist(), store.all_edges_um(), strict=True))
            frames = {number: store.frame(number) for number in sorted(needed(edges_um))}
            slurries.append(Trajectory(str(store.attributes["slurry"]), store.particles, frames, edges_um))
        first, names = slurries[0], slurries[-1].particles.phase_names
        if names != first.particles.phase_names:
            known = ", ".join(first.particles.phase_names)
            raise InputError(f"{path}: has the phases {', '.join(names)}, slurry {first.slurry} has {known}")
    return slurries
