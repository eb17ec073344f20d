"""Sizes of the final box: from predicted coordinates, or from a packing fraction. Pure numpy."""

import numpy as np


def scale_of_prediction(predicted_um: np.ndarray, last_um: np.ndarray) -> float:
    """Ratio of the final box edges to those at the last input frame, from the predicted coordinates themselves.

    The least-squares scale s of predicted = s x last over all coordinates (n, 3), both about the box centre, which lies
    at the origin: s = sum(predicted last) / sum(last^2).
    """
    return float((predicted_um * last_um).sum() / (last_um**2).sum())


def scale_to_packing_fraction(packing_fraction: float, particles_um3: float, edges_um: np.ndarray) -> float:
    """Ratio of the final box edges to `edges_um` (3,) for particles of volume `particles_um3` at a packing fraction.

    The shape of the box stays: s^3 = particles / (packing fraction x volume).
    """
    return float(np.cbrt(particles_um3 / (packing_fraction * np.prod(edges_um))))
