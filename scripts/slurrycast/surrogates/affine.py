"""The last input frame scaled into the final box: what equilibration does to the particles if all move with the box."""

from collections.abc import Mapping
from pathlib import Path

from slurrycast.surrogates.base import MEAN_PACKING_FRACTION, Surrogate
from slurrycast.surrogates.prediction import Prediction, PredictionInput


class Affine(Surrogate):
    """The last input frame scaled into the final box."""

    name = "affine"
    looks_at = "scaled coordinates of the particle itself in the last input frame, and the final box"
    box_rule = MEAN_PACKING_FRACTION

    def predict(self, inputs: PredictionInput, model_path: Path | None, settings: Mapping) -> Prediction:
        """Return the coordinates (n, 3) of the last input frame over its edges, times the final edges; um."""
        return Prediction(inputs.last.position_um / inputs.last.edges_um * inputs.final_edges_um)
