"""The last input frame as it is: what a prediction has to beat to be one."""

from collections.abc import Mapping
from pathlib import Path

from slurrycast.surrogates.base import LAST_FRAME, Surrogate
from slurrycast.surrogates.prediction import Prediction, PredictionInput


class Persistence(Surrogate):
    """The last input frame in its box."""

    name = "persistence"
    looks_at = "unwrapped coordinates of the particle itself in the last input frame"
    box_rule = LAST_FRAME

    def predict(self, inputs: PredictionInput, model_path: Path | None, settings: Mapping) -> Prediction:
        """Return the coordinates (n, 3) of the last input frame in um."""
        return Prediction(inputs.last.position_um)
