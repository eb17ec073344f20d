"""The last input frame scaled into the final box: what equilibration does to the particles if all move with the box."""

from collections.abc import Mapping
from pathlib import Path

from slurrycast.surrogates.prediction import Prediction, PredictionInput

NAME = "affine"
LOOKS_AT = "scaled coordinates of the particle itself in the last input frame, and the final box"
BOX_RULE = "mean_packing_fraction"
MODEL_FILE = None
WEIGHTS_OF = None
LEARNS_FROM = None
CONTINUES_DEM = None
HAS_SPREAD = False
VARIANT = None


def predict(inputs: PredictionInput, model_path: Path | None, settings: Mapping) -> Prediction:
    """Coordinates (n, 3) of the last input frame in units of its box edges, times the edges of the final box; um."""
    return Prediction(inputs.last.position_um / inputs.last.edges_um * inputs.final_edges_um)
