"""Least squares: final coordinates as one linear combination of those in the input frames.

    x_final = sum over the input frames k of c_k x_k

with the same c_k for all particles, slurries and axes. There is no constant: coordinates are about the box centre, and
neither a particle nor an axis has a preferred side. Like `vgg16` it is told nothing of a box and moves with the
coordinates' scale.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from slurrycast.data.dataset import TrainingSet
from slurrycast.data.features import COORDINATES
from slurrycast.data.frames import Frame
from slurrycast.runtime.files import InputError, write_text
from slurrycast.surrogates.base import SCALE_OF_PREDICTION, Surrogate
from slurrycast.surrogates.prediction import Prediction, PredictionInput


def fit_coefficients(
    training_set: TrainingSet, terms_um: np.ndarray, targets_um: np.ndarray, model_path: str | Path
) -> dict:
    """Fit one coefficient for each term by least squares, and write the model.

    Parameters
    ----------
    training_set
        What the terms and targets are of; tells the samples to fit to from those of the validation.
    terms_um, targets_um
        (n, 3, terms) and (n, 3).
    model_path
        File to write (JSON).

    Returns
    -------
    Content of the model: input frames, coefficients, and errors on both kinds of samples, mean squared ones in um2 and
    mean absolute ones in um. For comparison it has those of the affine map too, in the true final box of each slurry.
    """
    held = training_set.is_validation
    trained_um = terms_um[~held].reshape(-1, terms_um.shape[2])
    coefficients, *_ = np.linalg.lstsq(trained_um, targets_um[~held].ravel())
    model = {"input_frames": training_set.input_frames, "coefficients": coefficients.tolist()}
    off_um = {"": terms_um @ coefficients - targets_um, "affine_": training_set.affine_um() - training_set.targets}
    for name, values_um in off_um.items():
        for part, samples in (("training", ~held), ("validation", held)):
            model[f"{name}{part}_mse_um2"] = float((values_um[samples] ** 2).mean())
            model[f"{name}{part}_mae_um"] = float(abs(values_um[samples]).mean())
    write_text(model_path, json.dumps(model, indent=1) + "\n")
    return model


def combined(model_path: str | Path, frames: Sequence[Frame], terms_um: np.ndarray) -> np.ndarray:
    """Sum (n, 3) in um of terms (n, 3, terms) times the coefficients of a model.

    InputError if the file is no model, or was fitted to other frames or another number of terms.
    """
    try:
        model = json.loads(Path(model_path).read_text(encoding="utf-8"))
        fitted, coefficients = model["input_frames"], np.array(model["coefficients"], dtype=float)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{model_path}: not a readable linear model ({error})") from error
    asked, n_terms = [frame.number for frame in frames], terms_um.shape[2]
    if fitted != asked:
        raise InputError(f"{model_path}: was fitted to input frames {fitted}, asked with {asked}")
    if coefficients.shape != (n_terms,):
        raise InputError(f"{model_path}: coefficients have shape {coefficients.shape}, expected ({n_terms},)")
    return terms_um @ coefficients


class Linear(Surrogate):
    """One coefficient for each input frame."""

    name = "linear"
    looks_at = "unwrapped coordinates of the particle itself in the input frames"
    box_rule = SCALE_OF_PREDICTION
    model_file = "model.json"
    learns_from = "samples"

    def fit(self, training_set: TrainingSet, settings: Mapping, model_path: str | Path) -> dict:
        """Fit final coordinates, and write and return the model."""
        places_um = training_set.features[..., COORDINATES].swapaxes(1, 2)
        return fit_coefficients(training_set, places_um, training_set.targets, model_path)

    def predict(self, inputs: PredictionInput, model_path: str | Path, settings: Mapping) -> Prediction:
        """Predict final unwrapped coordinates in um. InputError if the model does not fit the input."""
        places_um = np.stack([frame.position_um for frame in inputs.frames], axis=-1)
        return Prediction(combined(model_path, inputs.frames, places_um))
