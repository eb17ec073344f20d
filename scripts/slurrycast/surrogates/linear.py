"""Least squares: final coordinates as one linear combination of those in the input frames.

    x_final = sum over the input frames k of c_k x_k

with the same c_k for all particles, slurries and axes. There is no constant: coordinates are about the box centre, and
neither a particle nor an axis has a preferred side. Like `vgg16` it is told nothing of a box and moves with the
coordinates' scale.
"""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from slurrycast.data.dataset import TrainingSet
from slurrycast.data.features import COORDINATES
from slurrycast.runtime.files import InputError, write_text
from slurrycast.surrogates.base import SCALE_OF_PREDICTION, Surrogate
from slurrycast.surrogates.prediction import Prediction, PredictionInput


class Linear(Surrogate):
    """One coefficient for each input frame."""

    name = "linear"
    looks_at = "unwrapped coordinates of the particle itself in the input frames"
    box_rule = SCALE_OF_PREDICTION
    model_file = "model.json"
    learns_from = "samples"

    def fit(self, training_set: TrainingSet, settings: Mapping, model_path: str | Path) -> dict:
        """Fit to the training samples and write the model: input frames, coefficients and errors (um2)."""
        held = training_set.is_validation
        places = training_set.features[..., COORDINATES].swapaxes(1, 2)  # samples, axes, frames
        trained, n_frames = places[~held], len(training_set.input_frames)
        coefficients, *_ = np.linalg.lstsq(trained.reshape(-1, n_frames), training_set.targets[~held].ravel())
        squares = (places @ coefficients - training_set.targets) ** 2
        model = {
            "input_frames": training_set.input_frames,
            "coefficients": coefficients.tolist(),
            "training_mse_um2": float(squares[~held].mean()),
            "validation_mse_um2": float(squares[held].mean()),
        }
        write_text(model_path, json.dumps(model, indent=1) + "\n")
        return model

    def predict(self, inputs: PredictionInput, model_path: str | Path, settings: Mapping) -> Prediction:
        """Predict final unwrapped coordinates in um. InputError if the model does not fit the input."""
        try:
            model = json.loads(Path(model_path).read_text(encoding="utf-8"))
            fitted, coefficients = model["input_frames"], np.array(model["coefficients"], dtype=float)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(f"{model_path}: not a readable linear model ({error})") from error
        asked = [frame.number for frame in inputs.frames]
        if fitted != asked:
            raise InputError(f"{model_path}: was fitted to input frames {fitted}, asked with {asked}")
        places_um = np.stack([frame.position_um for frame in inputs.frames], axis=-1)
        return Prediction(places_um @ coefficients)
