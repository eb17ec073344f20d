"""Least squares about the affine map: each particle moves on by a multiple of its last step in the box.

    x_final = (s_last + c x step) x final edges

Scaled coordinates s are unwrapped coordinates over box edges about the box centre, and the step is s_last less s in
the input frame before. The coefficient c is the same for all particles, slurries and axes; 0 is the `affine`
surrogate. Coefficients for earlier steps as well do not lower the error of the validation slurries.

Steps and displacements are less their mean over the particles of a slurry: a common shift has no meaning in a periodic
box, and nothing can or should be learned from it. Training takes the true final edges of each training slurry, a
prediction those that the mean packing fraction of the training slurries gives. Errors of the fit are in um2, at the
true final edges.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from slurrycast.data.dataset import TrainingSet
from slurrycast.data.features import COORDINATES
from slurrycast.surrogates.base import MEAN_PACKING_FRACTION, Surrogate
from slurrycast.surrogates.linear import combined, fit_coefficients
from slurrycast.surrogates.prediction import Prediction, PredictionInput


class LinearBox(Surrogate):
    """The affine map plus one coefficient times the last step about it."""

    name = "linear_box"
    looks_at = "scaled coordinates of the particle itself in the last two input frames, and the final box"
    box_rule = MEAN_PACKING_FRACTION
    model_file = "model.json"
    learns_from = "samples"
    least_frames = 2

    def fit(self, training_set: TrainingSet, settings: Mapping, model_path: str | Path) -> dict:
        """Fit displacements from the affine map in the true final boxes, and write and return the model."""
        slurry = training_set.slurry_index
        places_um, final_edges_um = training_set.features[..., COORDINATES], training_set.target_edges_um[slurry]
        scaled = places_um / training_set.input_edges_um[slurry]
        # Validation samples have means of their own, so that the fit does not depend on them.
        groups = 2 * slurry + training_set.is_validation
        steps_um = less_means(last_step_um(scaled, final_edges_um), groups)
        displacements_um = less_means(training_set.targets - training_set.affine_um(), groups)
        return fit_coefficients(training_set, steps_um, displacements_um, model_path)

    def predict(self, inputs: PredictionInput, model_path: str | Path, settings: Mapping) -> Prediction:
        """Predict final unwrapped coordinates in um, in the final box of the input.

        InputError if the model does not fit the input.
        """
        scaled = np.stack([frame.position_um / frame.edges_um for frame in inputs.frames], axis=1)
        steps_um = last_step_um(scaled, inputs.final_edges_um)
        displacements_um = combined(model_path, inputs.frames, steps_um - steps_um.mean(axis=0))
        return Prediction(scaled[:, -1] * inputs.final_edges_um + displacements_um)


def last_step_um(scaled: np.ndarray, final_edges_um: np.ndarray) -> np.ndarray:
    """Last step (n, 3, 1) in scaled coordinates (n, frames, 3), times the final edges (n or 1, 3)."""
    return ((scaled[:, -1] - scaled[:, -2]) * final_edges_um)[..., None]


def less_means(values: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Values (n, ...) less their mean over the samples of the same group (n,)."""
    centred = values.copy()
    for group in np.unique(groups):
        centred[groups == group] -= values[groups == group].mean(axis=0)
    return centred
