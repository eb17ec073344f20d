"""The particles of a slurry as the type table of its inputs describes them."""

from collections.abc import Mapping, Sequence

import numpy as np

from slurrycast.data.frames import Particles
from slurrycast.dem.recipe import sphere_volume_um3


def particles_of(types: Sequence[Mapping], id: np.ndarray, type: np.ndarray) -> Particles:
    """Describe particles.

    Parameters
    ----------
    types
        Section types of inputs.json.
    id, type
        Id and LAMMPS atom type (n,) of each particle.
    """
    table = {row["type"]: row for row in types}
    rows = [table[int(number)] for number in type]
    radius_um = np.array([row["diameter_um"] for row in rows]) / 2
    return Particles(
        id=id,
        type=type,
        phase=np.array([row["phase_index"] for row in rows]),
        size_class=np.array([row["size_class"] for row in rows]),
        radius_um=radius_um,
        mass_pg=np.array([row["density_g_cm3"] for row in rows]) * sphere_volume_um3(2 * radius_um),
        phase_names=tuple(dict.fromkeys(row["phase"] for row in types)),
    )


def total_volume_um3(particles: Particles) -> float:
    """Volume of all particles in um3, with what they share where they overlap."""
    return float(np.sum(sphere_volume_um3(2 * particles.radius_um)))
