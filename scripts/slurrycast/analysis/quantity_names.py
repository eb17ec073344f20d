"""Names of the quantities of a microstructure, and of those that stand for several phases."""

from collections.abc import Sequence
from itertools import combinations, combinations_with_replacement, product

SUMS = ("all", "ceramic", "nonceramic", "organic", "void")  # what a phase can't be called


def tape_quantities(
    phases: Sequence[str],
    organic: str,
    spacings_um: Sequence[float],
    axes: Sequence[str],
    media: Sequence[str],
    with_limit: bool,
) -> list[str]:
    """Quantities that every tape has, by name.

    Parameters
    ----------
    phases, organic
        All phases in their order, and the one that is no ceramic.
    spacings_um, axes, media, with_limit
        Of the tortuosity, as `microstructure.tortuosities` takes them.
    """
    ceramics = [phase for phase in phases if phase != organic]
    shares = product([*ceramics, "ceramic", "organic", "void"], ("nominal", "union"))
    tortuosities = [
        f"tortuosity_{axis}_{grid}" if medium == "void" else f"tortuosity_{medium}_{axis}_{grid}"
        for medium, axis in product(media, axes)
        for grid in [*(f"{spacing:g}um" for spacing in spacings_um), *(["extrapolated"] if with_limit else [])]
    ]
    return [
        *("density", "green_density", "shrinkage"),
        *(f"share_{name}_{kind}" for name, kind in shares),
        *("share_ceramic_filled", "share_nonceramic_filled"),
        *(f"coordination_{a}-{b}" for a, b in combinations_with_replacement(phases, 2)),
        *("coordination_all", "contacts_ceramic", *(f"contacts_{a}-{b}" for a, b in combinations(ceramics, 2))),
        *(f"percolation_{name}_{axis}" for name, axis in product([*ceramics, "ceramic"], "xyz")),
        *("pore_size_mean", "pore_size_d10", "pore_size_d90"),
        *tortuosities,
    ]
