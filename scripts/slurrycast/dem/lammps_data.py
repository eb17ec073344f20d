"""LAMMPS data files of spheres."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from slurrycast.dem.recipe import ParticleType
from slurrycast.runtime.files import write_text


def write_data(
    path: str | Path,
    title: str,
    types: Sequence[ParticleType],
    particle_type: np.ndarray,
    position_um: np.ndarray,
    lower_um: np.ndarray,
    edges_um: np.ndarray,
) -> None:
    """Write a data file of `atom_style sphere`, from which float64 numbers read back the same.

    Parameters
    ----------
    path, title
        The file, and the words at the start of its first line.
    types
        All particle types.
    particle_type
        Type number (n,) of each particle; ids count from 1 in this order.
    position_um
        Positions (n, 3) in um inside the box.
    lower_um, edges_um
        Lower corner (3,) and edges (3,) of the box in um.
    """
    upper_um = lower_um + edges_um
    bounds = [
        f"{low!r} {high!r} {axis}lo {axis}hi"
        for low, high, axis in zip(lower_um.tolist(), upper_um.tolist(), "xyz", strict=True)
    ]
    type_columns = {t.type: f"{t.type} {t.diameter_um!r} {t.density_g_cm3!r}" for t in types}
    atoms = [
        f"{number} {type_columns[int(kind)]} {x!r} {y!r} {z!r}"
        for number, (kind, (x, y, z)) in enumerate(zip(particle_type, position_um.tolist(), strict=True), 1)
    ]
    columns = f"{title}: id type diameter(um) density(g/cm3) x y z(um)"
    head = [columns, "", f"{len(atoms)} atoms", f"{len(types)} atom types", "", *bounds, "", "Atoms # sphere", ""]
    write_text(path, "\n".join([*head, *atoms, ""]))
