"""What the training range compares, read from frame stores."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slurrycast.analysis.training_range import State
from slurrycast.data.frames import read_frames
from slurrycast.dem.recipe import particle_types
from slurrycast.runtime.files import InputError


@dataclass(frozen=True)
class SlurryState:
    """A slurry at a frame: id, physics of its DEM, state, and its densities (g/cm3) at earlier frames."""

    slurry: str
    physics: Mapping
    state: State
    earlier_g_cm3: Sequence[float]


def has_frame(path: str | Path, frame: int) -> bool:
    """Whether the frames of a slurry hold one of this number."""
    with read_frames(path) as store:
        return frame in store.frame_numbers


def read_state(path: str | Path, frame: int, earlier: Sequence[int] = ()) -> SlurryState:
    """Read the state of a slurry at `frame`, and its densities at `earlier` frames. InputError as from the store."""
    with read_frames(path) as store:
        if "physics" not in store.attributes:
            raise InputError(f"{path}: does not say which recipe the slurry is of")
        physics = json.loads(store.attributes["physics"])
        phases = physics["formulation"]["phases"]
        types = particle_types({name: phases[name] for name in physics["formulation"]["order"]})
        counts = np.array([np.sum(store.particles.type == each.type) for each in types])
        state = State(types, counts, store.box(frame)[1], store.density_g_cm3(frame))
        earlier_g_cm3 = [store.density_g_cm3(number) for number in earlier]
        return SlurryState(str(store.attributes["slurry"]), physics, state, earlier_g_cm3)
