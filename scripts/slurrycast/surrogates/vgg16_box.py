"""The published network, fed and asked in coordinates that do not depend on the size of the box.

The layers are those of `vgg16`. Of each input frame it may look at the particle itself (phase, radius, scaled
coordinates s, which are unwrapped coordinates over box edges about the box centre, and coordination) and at the box
edges in um, and at nothing later or of other particles. It is asked for the displacement from the affine prediction,
(s_final - s_last) x final edges in um: 0 is the `affine` surrogate. Training takes the true final edges of each
training slurry, a prediction those that the mean packing fraction of the training slurries gives. Inputs and target
are standardised by the training samples, inside the model.

Variants, each of them one step back to `vgg16`, for the ablation:

    absolute    asked for s_final itself, in which the final edges are given as well
    xu          coordinates of the input are in um. The target in um, x_final less the affine prediction, is the same
                number as the displacement above, so nothing else changes
    nobox       no box edges in the input

Losses are in um2 and um for all of them, at the true final edges: those of `vgg16`, which has to find the box as well,
hold the error of its box too.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from slurrycast.data.dataset import TrainingSet
from slurrycast.data.features import COORDINATES, FEATURE_NAMES, particle_history
from slurrycast.surrogates import vgg16
from slurrycast.surrogates.base import MEAN_PACKING_FRACTION, Surrogate
from slurrycast.surrogates.prediction import Prediction, PredictionInput
from slurrycast.surrogates.samples import Samples
from slurrycast.surrogates.stored_model import StoredLayer


def network_inputs(history: np.ndarray, edges_um: np.ndarray, change: str | None) -> np.ndarray:
    """Features (n, frames, 9), or 6 without the box, of a history (n, frames, 6) and edges (n or 1, frames, 3)."""
    features = history.copy()
    if change != "xu":
        features[..., COORDINATES] /= edges_um
    if change != "nobox":
        features = np.concatenate([features, np.broadcast_to(edges_um, features[..., COORDINATES].shape)], axis=2)
    return features


def _origin_um(history: np.ndarray, edges_um: np.ndarray, final_edges_um: np.ndarray, change: str | None) -> np.ndarray:
    """What a target of 0 stands for: the affine prediction or the box centre, (n, 3)."""
    return history[:, -1, COORDINATES] / edges_um[:, -1] * final_edges_um * (change != "absolute")


def _unit_um(final_edges_um: np.ndarray, change: str | None) -> np.ndarray:
    """What a target of 1 stands for: 1 um or the final edges."""
    return final_edges_um if change == "absolute" else np.ones_like(final_edges_um)


def samples(training_set: TrainingSet, change: str | None = None) -> Samples:
    """What the network, or its variant `change`, learns from; targets are in um, of `absolute` in final box edges."""
    edges_um = training_set.input_edges_um[training_set.slurry_index]
    final_edges_um = training_set.target_edges_um[training_set.slurry_index]
    unit_um = _unit_um(final_edges_um, change)
    origin_um = _origin_um(training_set.features, edges_um, final_edges_um, change)
    return Samples(
        features=network_inputs(training_set.features, edges_um, change),
        targets=(training_set.targets - origin_um) / unit_um,
        unit_um=unit_um,
        is_validation=training_set.is_validation,
    )


class Vgg16Box(Surrogate):
    """The published network on coordinates that do not depend on the size of the box."""

    name = "vgg16_box"
    looks_at = (
        "phase, radius, scaled coordinates and coordination of the particle itself and the box edges in the input "
        "frames, and the final box"
    )
    box_rule = MEAN_PACKING_FRACTION
    model_file = "model.keras"
    weights_epoch = "lowest"
    goes_on = True
    learns_from = "samples"
    variant = re.compile("(?P<change>absolute|xu|nobox)?")

    def input_shapes(self, n_frames: int, settings: Mapping) -> dict[str, tuple[int, ...]]:
        """Shape of what the network takes of a particle: frames, features."""
        return {"features": (n_frames, len(FEATURE_NAMES) + 3 * (settings.get("change") != "nobox"))}

    def misfit(self, layers: Sequence[StoredLayer], n_frames: int, n_phases: int, settings: Mapping) -> str | None:
        """What of the layers of a stored model does not fit; see `vgg16.misfit`."""
        return vgg16.misfit(layers, self.input_shapes(n_frames, settings)["features"], True)

    def train(
        self, data: TrainingSet, settings: Mapping, folder: Path, held_out: Mapping[str, TrainingSet] | None = None
    ) -> dict[str, float]:
        """Train as `vgg16.train` does, on standardised samples."""
        change = settings.get("change")
        name = f"{self.name}_{change}" if change else self.name
        others = {name: (samples(other, change), other.slurry_index) for name, other in (held_out or {}).items()}
        return vgg16.train(name, samples(data, change), True, settings, folder, others)

    def predict(self, inputs: PredictionInput, model_path: str | Path, settings: Mapping) -> Prediction:
        """Predict final unwrapped coordinates in um, in the final box of the input."""
        change = settings.get("change")
        history = particle_history(inputs.particles, inputs.frames)
        edges_um = np.array([[frame.edges_um for frame in inputs.frames]])
        final_edges_um = inputs.final_edges_um
        output = vgg16.apply_model(model_path, network_inputs(history, edges_um, change))
        origin_um = _origin_um(history, edges_um, final_edges_um, change)
        return Prediction(origin_um + output * _unit_um(final_edges_um, change))
