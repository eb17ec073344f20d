"""No learning: the DEM goes on from the last input frame for a short while, in which its box is driven to the end.

Where `early_dem` waits for a barostat, and lets particles wander until the density rests, this one stops as soon as the
box is what the training slurries say it will be. Of all that moves particles from their affine places it keeps the
collisions, at a pace of its own.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from slurrycast.dem.lammps_run import Progress
from slurrycast.runtime.files import RunError
from slurrycast.surrogates.prediction import Prediction, PredictionInput

NAME = "driven_dem"
LOOKS_AT = (
    "all particles, their velocities and contacts at the last input frame, the forces of the DEM, and the final box"
)
BOX_RULE = "mean_packing_fraction"
MODEL_FILE = None
WEIGHTS_OF = None
LEARNS_FROM = None
CONTINUES_DEM = "drive.lmp"
HAS_SPREAD = False
VARIANT = None

EDGE_TOLERANCE = 1e-9  # of what LAMMPS reads, multiplies and writes with 15 digits


def most_steps(settings: Mapping) -> int:
    """Steps that a prediction takes."""
    return settings["steps"]


def predict(inputs: PredictionInput, model_path: Path | None, settings: Mapping) -> Prediction:
    """Coordinates (n, 3) in um after `steps` steps in which the box goes to the final edges of the input.

    RunError as of `lammps_run.continue_dem`, and if the box does not end there.
    """
    from slurrycast.dem.lammps_dump import read_dump

    going_on, steps, edges_um = inputs.continuation, settings["steps"], inputs.final_edges_um
    final = {f"final_l{axis}_um": repr(float(edge)) for axis, edge in zip("xyz", edges_um, strict=True)}
    going_on.run(
        CONTINUES_DEM,
        {**final, "steps": steps, "thermo_every_steps": max(1, steps // 10)},
        Progress(f"{inputs.slurry} driven", 0, steps, print),
    )
    (end,) = read_dump(going_on.work / "driven.dump")
    if abs(end.edges_um / edges_um - 1).max() > EDGE_TOLERANCE:
        raise RunError(
            f"{inputs.slurry}: driven to a box of {_in_words(end.edges_um)} in place of {_in_words(edges_um)}; "
            f"log: {going_on.work / 'drive.log'}"
        )
    print(f"[{inputs.slurry}] driven to the final box in {steps} steps")
    return Prediction(end.values[:, 3:6])


def _in_words(edges_um: np.ndarray) -> str:
    return f"{' x '.join(f'{edge:.6f}' for edge in edges_um)} um"
