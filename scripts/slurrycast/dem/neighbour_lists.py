"""Neighbour lists of LAMMPS for the sizes of a recipe, and what they cost.

By default `pair_style hybrid/overlay` gives all pairs of a list one cutoff, that of the largest particles. Where few
large particles lie among many small ones, most of each list is then too far away for any force. Nothing here changes a
force.
"""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from slurrycast.dem.recipe import ParticleType, mean_volume_um3

SKIN_SHARE = 0.3  # of the smallest diameter, as in the shipped recipe
WIDE_RATIO = 2.5  # largest over smallest diameter above which each pair of sizes has a cutoff of its own
PACKING_FRACTION = 0.66  # of a dense slurry
# One step with n particles in each list, over that of the shipped recipe (results/reference/neighbour_lists).
COST, COST_PER_NEIGHBOUR = 0.89, 0.005


def skin_um(dem: Mapping, types: Sequence[ParticleType]) -> float:
    """Skin of the neighbour lists: that of the section dem or, where it has none, one that fits the particle types."""
    given = dem["skin_um"]
    return SKIN_SHARE * min(t.diameter_um for t in types) if given is None else given


def is_wide(types: Sequence[ParticleType]) -> bool:
    """Whether each pair of sizes has a cutoff of its own."""
    diameters_um = [t.diameter_um for t in types]
    return max(diameters_um) > WIDE_RATIO * min(diameters_um)


def commands(types: Sequence[ParticleType]) -> list[str]:
    """LAMMPS commands that replace the default lists and ghost particles, for a wide range of sizes; else none.

    `comm_modify` has to be behind `neighbor`. The scripts set the skin themselves.
    """
    if not is_wide(types):
        return []
    return ["neighbor ${skin_um} multi", "comm_modify mode multi", "pair_modify neigh/trim no"]


def neighbours(
    types: Sequence[ParticleType], counts: Sequence[int], cutoff_factor: float, skin_um: float, own_cutoffs: bool
) -> float:
    """Mean number of particles in the list of a particle, each pair counted once, in a dense slurry without structure.

    Parameters
    ----------
    types, counts
        All particle types, and the number of particles of each (types,).
    cutoff_factor
        Of section force_field.lennard_jones.
    skin_um
        Skin of the lists.
    own_cutoffs
        Whether each pair of sizes has a cutoff of its own.
    """
    per_um3 = PACKING_FRACTION / mean_volume_um3(types, counts)
    largest_um = max(t.diameter_um for t in types)
    pairs = product(zip(types, np.asarray(counts) / np.sum(counts), strict=True), repeat=2)
    cubes_um3 = sum(
        share
        * other_share
        * (cutoff_factor * ((a.diameter_um + b.diameter_um) / 2 if own_cutoffs else largest_um) + skin_um) ** 3
        for (a, share), (b, other_share) in pairs
    )
    return float(per_um3 * 2 / 3 * np.pi * cubes_um3)


def relative_cost(
    types: Sequence[ParticleType], counts: Sequence[int], lennard_jones: Mapping, skin_um: float
) -> float:
    """CPU time of a step of the DEM for each particle, over that of the shipped recipe; at least 1.

    Parameters
    ----------
    types, counts
        All particle types, and the number of particles of each (types,).
    lennard_jones
        Section force_field.lennard_jones of the configuration.
    skin_um
        Skin of the neighbour lists.
    """
    listed = neighbours(types, counts, lennard_jones["cutoff_factor"], skin_um, is_wide(types))
    return max(1.0, COST + COST_PER_NEIGHBOUR * listed)
