"""What a surrogate learns from that sees a slurry as a whole: particles and some of their frames, slurry by slurry."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from slurrycast.files import InputError
from slurrycast.frames import Frame, Particles, read_frames


@dataclass(frozen=True)
class Trajectory:
    """One slurry: its particles, and frames by their numbers."""

    slurry: str
    particles: Particles
    frames: Mapping[int, Frame]


def read_trajectories(paths: Iterable[str | Path], numbers: Sequence[int]) -> list[Trajectory]:
    """Read the frames of these `numbers` from frame stores.

    InputError if one of them is not there, and for phases that differ from those of the first slurry.
    """
    slurries = []
    for path in paths:
        with read_frames(path) as store:
            frames = {number: store.frame(number) for number in sorted(numbers)}
            slurries.append(Trajectory(str(store.attributes["slurry"]), store.particles, frames))
        first, names = slurries[0], slurries[-1].particles.phase_names
        if names != first.particles.phase_names:
            known = ", ".join(first.particles.phase_names)
            raise InputError(f"{path}: has the phases {', '.join(names)}, slurry {first.slurry} has {known}")
    return slurries
