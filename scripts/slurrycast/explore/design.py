"""The design: recipes that fill the ranges, repetitions at their centre, and those that the full DEM confirms."""

import numpy as np
import pandas as pd

from slurrycast.explore.inputs import CONFIRMED, InputSpace, sobol_points

DIGITS = 6  # after the point; the last mass fraction takes what rounding leaves


def farthest(points: np.ndarray, start: np.ndarray, count: int) -> list[int]:
    """Places of `count` of the points (n, d), each the farthest from `start` (d,) and from those before it."""
    distance = np.linalg.norm(points - start, axis=1)
    chosen = []
    for _ in range(count):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen


def design(space: InputSpace, points: int, replicas: int, confirmations: int, seed: int) -> pd.DataFrame:
    """Table of recipes: columns id, confirm and those of the inputs.

    Parameters
    ----------
    space
        Ranges of the inputs.
    points
        Number of different recipes, P1 and so on. The table of fewer begins with the same ones.
    replicas
        Rows C1 and so on at the centre, whose slurries differ in their seeds alone.
    confirmations
        Number of points that the full DEM confirms too: the farthest from the centre, and from each other.
    seed
        Seed of the scrambled Sobol sequence.
    """
    inputs = space.at(sobol_points(points, len(space.coordinates), seed))
    chosen = farthest(space.scaled(inputs), space.scaled(space.centre()[None])[0], min(confirmations, points))
    table = pd.DataFrame(np.vstack([inputs, np.tile(space.centre(), (replicas, 1))]), columns=space.names)
    table = table.round(DIGITS)
    shares = [name for name, is_share in zip(space.names, space.shares, strict=True) if is_share]
    if shares:
        table[shares[-1]] = (space.share_total - table[shares[:-1]].sum(axis=1)).round(DIGITS)
    table.insert(0, "id", [*(f"P{n}" for n in range(1, points + 1)), *(f"C{n}" for n in range(1, replicas + 1))])
    table.insert(1, "confirm", [CONFIRMED if place in chosen else "" for place in range(len(table))])
    return table
