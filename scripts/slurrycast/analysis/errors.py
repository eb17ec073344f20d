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
    """Deviation (n, 3) of predicted from target coordinates, without a common shift.

    Parameters
    ----------
    target_um, predicted_um
        Unwrapped coordinates (n, 3) in um about the centre of their box, of the same particles in the same order.

    Notes
    -----
    The mean over the particles is taken from both first: a common shift has no meaning in a periodic box.
    """
    return predicted_um - predicted_um.mean(axis=0) - (target_um - target_um.mean(axis=0))


def coordinate_errors(target_um: np.ndarray, predicted_um: np.ndarray) -> dict[str, CoordinateError]:
    """Errors of predicted coordinates.

    Parameters
    ----------
    target_um, predicted_um
        As `deviation_um` takes them.

    Returns
    -------
    Errors for "x", "y", "z" and "all".

    Notes
    -----
    With the deviation e of n particles along one axis:

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
    target_um: np.ndarray, predicted_um: np.ndarray, target_edges_um: np.ndarray, predicted_edges_um: np.ndarray
) -> dict[str, CoordinateError]:
    """Errors of predicted coordinates that are rescaled to the box of the target, per axis about its centre.

    This removes the error of the predicted box and leaves that of the places within it.

    Parameters
    ----------
    target_um, predicted_um
        As `deviation_um` takes them.
    target_edges_um, predicted_edges_um
        Edges (3,) in um of both boxes.

    Returns
    -------
    As `coordinate_errors`.
    """
    return coordinate_errors(target_um, predicted_um * (target_edges_um / predicted_edges_um))
