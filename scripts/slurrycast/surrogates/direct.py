"""No DEM at all: random places in a loose box, for the relaxation alone to make a slurry of.

Input frames and learning are worth something only where another surrogate ends nearer to the DEM than this one.
"""

from collections.abc import Mapping
from pathlib import Path

from slurrycast.data.final_box import scale_to_packing_fraction
from slurrycast.dem.particles import total_volume_um3
from slurrycast.surrogates.base import LOOSE_PACKING, Surrogate
from slurrycast.surrogates.prediction import Prediction, PredictionInput


class Direct(Surrogate):
    """Random places in a box that the relaxation closes."""

    name = "direct"
    looks_at = "nothing but the recipe"
    box_rule = LOOSE_PACKING
    from_recipe = True

    def predict(self, inputs: PredictionInput, model_path: Path | None, settings: Mapping) -> Prediction:
        """Return the random places (n, 3) in um in the box of `packing_fraction`, and its edges (3,)."""
        volume_um3 = total_volume_um3(inputs.particles)
        scale = scale_to_packing_fraction(settings["packing_fraction"], volume_um3, inputs.last.edges_um)
        return Prediction(scale * inputs.last.position_um, scale * inputs.last.edges_um)
