"""How far predicted coordinates are from the target ones: MSE, MAE and R2 per axis and over all axes."""

from dataclasses import dataclass

import numpy as np

AXES = ("x", "y", "z", "all")


@dataclass(frozen=True)
class CoordinateError:
    """Error along one axis, or over all three."""

    mse_um2: float
    mae_um: float
    r2: float


def deviation_um(target_um: np.ndarray, predicted_um: np.ndarray) -> np.ndarray:
    """What predicted coordinates (n, 3) deviate from the target's (n, 3) by, (n, 3), without a common shift.

    Both are unwrapped, about the centre of their own box, of the same particles in the same order. The mean over the
    particles is taken from both first: a common shift has no meaning in a periodic box.
    """
    return predicted_um - predicted_um.mean(axis=0) - (target_um - target_um.mean(axis=0))


def coordinate_errors(target_um: np.ndarray, predicted_um: np.ndarray) -> dict[str, CoordinateError]:
    """Errors of predicted coordinates (n, 3) against the target's (n, 3), for "x", "y", "z" and "all".

    Both are as `deviation_um` takes them. With its e = predicted - target of n particles along one axis:

        MSE = sum(e^2) / n,   MAE = sum(|e|) / n,   R2 = 1 - SS_res / SS_tot,
        SS_res = sum(e^2),    SS_tot = sum((target - mean(target))^2)

    "all" pools the axes: MSE and MAE are means over particles and axes, and SS_res and SS_tot are summed over the
    axes before they are divided, so a long axis weighs more in R2 than a short one.
    """
    deviations_um = deviation_um(target_um, predicted_um)
    target_um = target_um - target_um.mean(axis=0)
    errors = {}
    for axis, columns in zip(AXES, (0, 1, 2, slice(None)), strict=True):
        e, t = deviations_um[:, columns], target_um[:, columns]
        r2 = 1.0 - np.sum(e**2) / np.sum(t**2)
        errors[axis] = CoordinateError(float(np.mean(e**2)), float(np.mean(np.abs(e))), float(r2))
    return errors


def true_box_errors(
    target_um: np.ndarray,
    predicted_um: np.ndarray,
    target_edges_um: np.ndarray,
    predicted_edges_um: np.ndarray,
) -> dict[str, CoordinateError]:
    """`coordinate_errors` of the prediction rescaled, per axis about the box centre, to the box edges of the target.

    Edges have shape (3,). This takes the error of the predicted box out and leaves that of the places within it.
    """
    return coordinate_errors(target_um, predicted_um * (target_edges_um / predicted_edges_um))
