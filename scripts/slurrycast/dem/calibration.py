"""The friction of the drying for a measured green density."""

import math
from collections.abc import Callable, Iterator


def bisection(
    density: Callable[[float], float], wanted: float, ends: tuple[float, float], tolerance: float, dryings: int
) -> Iterator[tuple[float, float]]:
    """Yield friction and density of each drying, the last one nearest to the wanted density.

    Those of both ends come first, and once more if one of them is the nearest. A density beyond both is met by none:
    then there are these two alone.

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
    at_ends, between = [(most, loosest), (least, densest)], []
    yield from at_ends
    if not loosest * (1 - tolerance) <= wanted <= densest * (1 + tolerance):
        return

    def off(drying: tuple[float, float]) -> float:
        return abs(drying[1] / wanted - 1)

    while len(between) < dryings - 2 and min(map(off, [*at_ends, *between])) > tolerance:
        friction = math.sqrt(least * most)
        between.append((friction, density(friction)))
        if between[-1][1] > wanted:
            least = friction
        else:
            most = friction
    yield from sorted(between, key=off, reverse=True)
    nearest = min(at_ends, key=off)
    if not between or off(nearest) < min(map(off, between)):
        yield nearest
