"""What a surrogate is asked and what it answers."""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slurrycast.data.frames import Frame, Particles
from slurrycast.dem.lammps_log import Log
from slurrycast.dem.lammps_run import Launcher, force_field_variables, refuse_lost_history, run_lammps


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
        """Continue the DEM and return the log of LAMMPS, which has the name of the script.

        Parameters
        ----------
        script, progress
            As `lammps_run.run_lammps` takes them.
        variables
            Variables of the script that the physics of the slurry leaves open (round_steps, max_rounds, ...), and any
            that replace the physics.

        Raises
        ------
        RunError
            As `run_lammps`, and if LAMMPS dropped the contact history that the restart file holds.
        """
        physics = self.inputs["physics"]
        shutil.copyfile(self.restart, self.work / "start.restart")
        shutil.copyfile(self.coefficients, self.work / "coefficients.lmp")
        files = {"restart": "start.restart", "coefficients": "coefficients.lmp"}
        settings = {**force_field_variables(physics), **files, **variables}
        name = f"{Path(script).stem}.log"
        log = run_lammps(self.launcher, script, settings, self.work, name, progress)
        refuse_lost_history(self.work / name, self.restart)
        return log


@dataclass(frozen=True)
class PredictionInput:
    """All that a surrogate may look at: the input frames of one slurry and nothing later.

    Attributes
    ----------
    slurry
        Its id.
    particles, frames
        Its n particles, and the input frames in their order; frame 0 alone, with random places, for surrogates that
        need nothing of the DEM.
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
