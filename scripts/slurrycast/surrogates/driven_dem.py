"""The DEM continued for a short while, in which its box is driven to the final box at a set strain rate.

Nothing is learned. Where `early_dem` waits for a barostat, and lets particles wander until the density rests, this one
stops as soon as the box has the edges that the training slurries tell. Of all that moves particles away from the affine
map it keeps the collisions.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from slurrycast.dem.lammps_run import Progress
from slurrycast.runtime.files import RunError
from slurrycast.surrogates.base import MEAN_PACKING_FRACTION, Surrogate
from slurrycast.surrogates.prediction import Prediction, PredictionInput

EDGE_TOLERANCE = 1e-9  # of what LAMMPS reads, multiplies and writes with 15 digits


class DrivenDem(Surrogate):
    """The DEM with its box driven to the final one."""

    name = "driven_dem"
    looks_at = (
        "all particles, their velocities and contacts at the last input frame, the forces of the DEM, and the final box"
    )
    box_rule = MEAN_PACKING_FRACTION
    dem_script = "drive.lmp"

    def most_steps(self, settings: Mapping) -> int:
        """Steps that a prediction takes."""
        return settings["steps"]

    def predict(self, inputs: PredictionInput, model_path: Path | None, settings: Mapping) -> Prediction:
        """Return the coordinates (n, 3) in um after `steps` steps in which the box goes to the final edges.

        RunError as from `Continuation.run`, and if the box does not end there.
        """
        from slurrycast.dem.lammps_dump import read_dump

        continuation, steps, edges_um = inputs.continuation, settings["steps"], inputs.final_edges_um
        final = {f"final_l{axis}_um": repr(float(edge)) for axis, edge in zip("xyz", edges_um, strict=True)}
        continuation.run(
            self.dem_script,
            {**final, "steps": steps, "thermo_every_steps": max(1, steps // 10)},
            Progress(f"{inputs.slurry} driven", 0, steps, print),
        )
        (end,) = read_dump(continuation.work / "driven.dump")
        if abs(end.edges_um / edges_um - 1).max() > EDGE_TOLERANCE:
            raise RunError(
                f"{inputs.slurry}: driven to a box of {_in_words(end.edges_um)} in place of {_in_words(edges_um)}; "
                f"log: {continuation.work / 'drive.log'}"
            )
        print(f"[{inputs.slurry}] driven to the final box in {steps} steps")
        return Prediction(end.values[:, 3:6])


def _in_words(edges_um: np.ndarray) -> str:
    return f"{' x '.join(f'{edge:.6f}' for edge in edges_um)} um"
