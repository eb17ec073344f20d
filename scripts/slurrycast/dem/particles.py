"""The particles of a slurry as the type table of its inputs describes them, and random places for them."""

from collections.abc import Mapping, Sequence

import numpy as np

from slurrycast.data.frames import Frame, Particles
from slurrycast.data.periodic import to_scaled
from slurrycast.dem.recipe import box_edges_um, derived_seed, random_positions_um, sphere_volume_um3


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


def random_start(inputs: Mapping, purpose: str) -> tuple[Particles, Frame]:
    """Particles of a slurry at random places in the box in which its DEM starts, as frame 0.

    Parameters
    ----------
    inputs
        Content of inputs.json.
    purpose
        What the places are for: they follow from it and the seed of the slurry.

    Returns
    -------
    All n particles, sorted by type, and the frame; particles may overlap.
    """
    formulation, row = inputs["physics"]["formulation"], inputs["physics"]["slurry"]
    type = np.repeat([t["type"] for t in inputs["types"]], [t["particles"] for t in inputs["types"]])
    particles = particles_of(inputs["types"], np.arange(1, len(type) + 1), type)
    volume_um3 = float(sphere_volume_um3(2 * particles.radius_um).sum())
    edges_um = box_edges_um(volume_um3 / formulation["initial_packing_fraction"], row["thickness_ratio"])
    rng = np.random.default_rng(derived_seed(row["seed"], purpose))
    position_um = random_positions_um(len(particles), edges_um, rng)
    not_counted = np.full(len(particles), -1, dtype=np.int32)
    scaled = to_scaled(position_um, -edges_um / 2, edges_um)
    return particles, Frame(0, 0, 0.0, position_um, scaled, not_counted, -edges_um / 2, edges_um)
