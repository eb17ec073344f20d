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
    """Write a data file of `atom_style sphere`; ids count from 1 in the order of the arrays.

    `particle_type` (n,) are type numbers of `types`, `position_um` (n, 3) lies in the box with lower corner `lower_um`
    (3,) and edges `edges_um` (3,). Numbers are written so that float64 reads back the same.
    """
    upper_um = lower_um + edges_um
    bounds = [
        f"{low!r} {high!r} {axis}lo {axis}hi"
        for low, high, axis in zip(lower_um.tolist(), upper_um.tolist(), "xyz", strict=True)
    ]
    of_type = {t.type: f"{t.type} {t.diameter_um!r} {t.density_g_cm3!r}" for t in types}
    atoms = [
        f"{number} {of_type[int(kind)]} {x!r} {y!r} {z!r}"
        for number, (kind, (x, y, z)) in enumerate(zip(particle_type, position_um.tolist(), strict=True), 1)
    ]
    head = [f"{len(atoms)} atoms", f"{len(types)} atom types", "", *bounds]
    write_text(
        path,
        "\n".join(
            [f"{title}: id type diameter(um) density(g/cm3) x y z(um)", "", *head, "", "Atoms # sphere", "", *atoms, ""]
        ),
    )
