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
    """How to go on with the DEM from the last input frame.

    `restart` and `coefficients` are files of the slurry's run, `inputs` is the content of its inputs.json; `work` is an
    empty folder.
    """

    restart: Path
    coefficients: Path
    inputs: Mapping
    launcher: Launcher
    work: Path

    def run(self, script: str, variables: Mapping[str, object], progress: Callable[[int, float], None]) -> Log:
        """Go on by `script` of scripts/lammps with its own `variables`; its log. RunError as of `continue_dem`."""
        places = self.restart, self.coefficients, self.work
        return continue_dem(script, self.launcher, self.inputs, *places, variables, progress)


@dataclass(frozen=True)
class PredictionInput:
    """All that a surrogate may look at: the input frames of one slurry, in their order, and nothing later.

    `final_edges_um` (3,) is given where the rule for the final box needs no prediction, `continuation` where the
    surrogate goes on with the DEM.
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
    """Unwrapped coordinates (n, 3) about the box centre in um.

    `edges_um` (3,) only if the surrogate found the box, `spread_um` (n, 3) only if it says how sure it is: the standard
    deviation that it expects of each coordinate.
    """

    position_um: np.ndarray
    edges_um: np.ndarray | None = None
    spread_um: np.ndarray | None = None
