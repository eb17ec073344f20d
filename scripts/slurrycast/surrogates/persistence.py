"""The last input frame as it is: what a prediction has to beat to be one."""

from collections.abc import Mapping
from pathlib import Path

from slurrycast.surrogates.prediction import Prediction, PredictionInput

NAME = "persistence"
LOOKS_AT = "unwrapped coordinates of the particle itself in the last input frame"
BOX_RULE = "last_frame"
MODEL_FILE = None
WEIGHTS_OF = None
LEARNS_FROM = None
CONTINUES_DEM = None
HAS_SPREAD = False
VARIANT = None


def predict(inputs: PredictionInput, model_path: Path | None, settings: Mapping) -> Prediction:
    """Coordinates (n, 3) of the last input frame, um."""
    return Prediction(inputs.last.position_um)
