"""The recipes whose properties are expected nearest to a target."""

import numpy as np

CANDIDATES = 2**12
APART = 0.25  # least distance of two recipes, in coordinates that go from 0 to 1


def nearest(distance: np.ndarray, points: np.ndarray, count: int, apart: float = APART) -> list[int]:
    """Places of the nearest candidates, of which no two are alike.

    Parameters
    ----------
    distance
        Distance (n,) from the target.
    points
        The candidates (n, d) in the unit cube.
    count, apart
        How many, at most, and how far apart at least.
    """
    chosen: list[int] = []
    for place in np.argsort(distance, kind="stable"):
        if len(chosen) < count and all(np.linalg.norm(points[place] - points[other]) >= apart for other in chosen):
            chosen.append(int(place))
    return chosen
