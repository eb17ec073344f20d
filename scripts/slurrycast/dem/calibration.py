"""The friction of the drying for a measured green density."""

import math
from collections.abc import Callable, Iterator


def bisection(
    density: Callable[[float], float], wanted: float, ends: tuple[float, float], tolerance: float, dryings: int
) -> Iterator[tuple[float, float]]:
    """Yield friction and density of each drying, the last one nearest to the wanted density.

    A density beyond those of both ends is met by none: then there are these two alone.

    Parameters
    ----------
    density
        Density at a friction, which falls with it.
    wanted, ends
        The density, and the least and greatest friction.
    tolerance, dryings
        Share of the density that is near enough, and the number of dryings at most, three or more.
    """
    least, most = ends
    densest, loosest = density(least), density(most)
    yield most, loosest
    yield least, densest
    if not loosest * (1 - tolerance) <= wanted <= densest * (1 + tolerance):
        return
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
