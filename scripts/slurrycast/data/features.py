"""Features of each particle, in the article's form: one row a particle, no neighbours, no box."""

from collections.abc import Sequence

import numpy as np

from slurrycast.data.frames import Frame, Particles

FEATURE_NAMES = ("phase", "radius_um", "x_um", "y_um", "z_um", "coordination")
COORDINATES = slice(2, 5)  # x, y and z among them


def particle_history(particles: Particles, frames: Sequence[Frame]) -> np.ndarray:
    """Features of all n particles of a slurry.

    Parameters
    ----------
    particles, frames
        The particles, and the frames that the features are of.

    Returns
    -------
    Array (n, frames, 6) in the order of FEATURE_NAMES, lengths in um. Coordinates are unwrapped: wrapped ones jump at
    the periodic faces and would teach false motions.
    """
    static = np.column_stack([particles.phase, particles.radius_um])
    return np.stack([np.column_stack([static, frame.position_um, frame.coordination]) for frame in frames], axis=1)
