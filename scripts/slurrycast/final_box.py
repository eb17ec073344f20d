"""The final box, which is no input of a prediction: rules that give it. Pure numpy."""

import numpy as np


def scale_of_prediction(predicted_um: np.ndarray, last_um: np.ndarray) -> float:
    """Ratio of the final box edges to those at the last input frame, from the predicted coordinates themselves.

    The least-squares scale s of predicted = s x last over all coordinates (n, 3), both about the box centre, which lies
    at the origin: s = sum(predicted last) / sum(last^2).
    """
    return float((predicted_um * last_um).sum() / (last_um**2).sum())


RULES = {"scale_of_prediction": scale_of_prediction}
