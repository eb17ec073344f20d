"""The friction of the drying for a measured green density."""

import math
from collections.abc import Callable, Iterator

from slurrycast.runtime.files import InputError


def bisection(
    density: Callable[[float], float], wanted: float, ends: tuple[float, float], tolerance: float, dryings: int
) -> Iterator[tuple[float, float]]:
    """Yield friction and density of each drying, the last one nearest to the wanted density.

    Parameters
    ----------
    density
        Density at a friction, which falls with it.
    wanted, ends
        The density, and the least and greatest friction.
    tolerance, dryings
        Share of the density that is near enough, and the number of dryings at most, three or more.

    Raises
    ------
    InputError
        If the density lies beyond those of both ends.
    """
    least, most = ends
    densest, loosest = density(least), density(most)
    yield most, loosest
    yield least, densest
    if not loosest <= wanted <= densest:
        raise InputError(
            f"a green density of {wanted:g} g/cm3: must be {loosest:.4g} to {densest:.4g}, those of a friction of "
            f"{most:g} and {least:g}"
        )
    made = []
    while len(made) < dryings - 2 and (not made or abs(made[-1][1] / wanted - 1) > tolerance):
        friction = math.sqrt(least * most)
        found = density(friction)
        made.append((friction, found))
        if found > wanted:
            least = friction
        else:
            most = friction
    yield from sorted(made, key=lambda each: -abs(each[1] - wanted))
