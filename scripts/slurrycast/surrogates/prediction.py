"""What a surrogate is asked and what it answers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slurrycast.data.frames import Frame, Particles
from slurrycast.dem.lammps_log import Log
from slurrycast.dem.lammps_run import Launcher, continue_dem


@dataclass(frozen=True)
class Continuation:
    """How to continue the DEM from the last input frame.

    Attributes
    ----------
    restart, coefficients
        Restart file and pair coefficients of the slurry.
    inputs
        Content of its inputs.json.
    launcher
        How LAMMPS is started.
    work
        Empty folder.
    """

    restart: Path
    coefficients: Path
    inputs: Mapping
    launcher: Launcher
    work: Path

    def run(self, script: str, variables: Mapping[str, object], progress: Callable[[int, float], None]) -> Log:
        """Continue by a script of scripts/lammps with its `variables`; its log. RunError as from `continue_dem`."""
        places = self.restart, self.coefficients, self.work
        return continue_dem(script, self.launcher, self.inputs, *places, variables, progress)


@dataclass(frozen=True)
class PredictionInput:
    """All that a surrogate may look at: the input frames of one slurry and nothing later.

    Attributes
    ----------
    slurry
        Its id.
    particles, frames
        Its n particles, and the input frames in their order.
    final_edges_um
        Edges (3,) of the final box, where its rule needs no prediction.
    continuation
        How to continue the DEM, for surrogates that do.
    """

    slurry: str
    particles: Particles
    frames: tuple[Frame, ...]
    final_edges_um: np.ndarray | None = None
    continuation: Continuation | None = None

    @property
    def last(self) -> Frame:
        """The last input frame."""
        return self.frames[-1]


@dataclass(frozen=True)
class Prediction:
    """What a surrogate answers for n particles.

    Attributes
    ----------
    position_um
        Unwrapped coordinates (n, 3) about the box centre.
    edges_um
        Edges (3,) of the final box, if the surrogate simulates it.
    spread_um
        Standard deviation (n, 3) that it expects of each coordinate, if it knows.
    """

    position_um: np.ndarray
    edges_um: np.ndarray | None = None
    spread_um: np.ndarray | None = None
