"""Maps of a property over two inputs, all others at the centre of their ranges."""

import numpy as np

from slurrycast.explore.inputs import InputSpace

STEPS = 41  # of a map, along either input


def grid(space: InputSpace, first: str, second: str, steps: int = STEPS) -> tuple[np.ndarray, np.ndarray]:
    """Inputs on a grid over two of the coordinates.

    Parameters
    ----------
    space, first, second
        The ranges, and the names of the two coordinates.
    steps
        Number of values of each.

    Returns
    -------
    Inputs (steps^2, inputs); and whether (steps^2,) they lie in the space: the last mass fraction is what the others
    leave, which may be beyond its range.
    """
    places = [space.names.index(name) for name in (first, second)]
    axes = [np.linspace(space.lower[place], space.upper[place], steps) for place in places]
    inputs = np.tile(space.centre(), (steps**2, 1))
    inputs[:, places] = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    shares = np.flatnonzero(space.shares)
    if len(shares):
        inputs[:, shares[-1]] = space.share_total - inputs[:, shares[:-1]].sum(axis=1)
    rounding = 1e-9
    inside = np.all((inputs >= space.lower - rounding) & (inputs <= space.upper + rounding), axis=1)
    return inputs, inside
