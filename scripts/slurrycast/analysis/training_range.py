"""The range of training slurries at the last input frame, and which slurries lie outside it. Pure numpy.

A surrogate interpolates between the slurries that it learned from; of a slurry outside their range it knows nothing.
The densities of earlier input frames, where these slurries were looser, belong to the range. So does the composition:
the share of each phase, its size and its density.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slurrycast.dem.recipe import ParticleType

# Boxes shrink isotropically, so Lz/Lx stays what it was but for rounding: of sums over each step, and of 15 digits.
RATIO_TOLERANCE = 1e-9
PHASE_SLACK = 0.5  # a phase has the whole number of particles nearest to its share
FRACTION_PREFIX = "fraction_"  # before the name of a phase, as the next two
RADIUS_PREFIX = "mean_radius_um_"
DENSITY_PREFIX = "density_g_cm3_"
THIS_RUN = "this run"  # whose training slurries, where it is not those of a model that was trained elsewhere


@dataclass(frozen=True)
class State:
    """A slurry at its last input frame.

    Attributes
    ----------
    types, counts
        Particle types of its recipe, and how many particles it has of each, (types,). A small slurry may have none of a
        rare one.
    edges_um
        Those of its box, (3,).
    density_g_cm3
        Its density.
    """

    types: Sequence[ParticleType]
    counts: np.ndarray
    edges_um: np.ndarray
    density_g_cm3: float


@dataclass(frozen=True)
class Value:
    """A quantity of one slurry, and the range in which it would be the same slurry, equal to `value` where exact."""

    value: float
    low: float
    high: float


def mean_value(values: np.ndarray, counts: np.ndarray, slack: np.ndarray) -> Value:
    """Mean of a quantity over the particles, with the least and greatest one where their numbers are uncertain.

    Parameters
    ----------
    values
        Value of the quantity in each group of particles, (groups,).
    counts, slack
        Number of particles in each group, and how far it may be off, (groups,).

    Notes
    -----
    The mean is sum((n + a) v) / sum(n + a) with |a| <= slack and n + a >= 0. Its derivative by a has the sign of v less
    the mean, so it is extreme where all groups above some value are at one end of their range and the others at the
    other end.
    """
    mean = float(counts @ values / counts.sum())
    order = np.argsort(values)
    values, most = values[order], (counts + slack)[order]
    least = np.maximum(counts - slack, 0)[order]
    above = np.arange(len(values)) >= np.arange(len(values) + 1)[:, np.newaxis]  # (thresholds, groups)
    low, high = (np.where(above, *ends) for ends in ((least, most), (most, least)))
    return Value(
        mean,
        float(min(weights @ values / weights.sum() for weights in low if weights.any())),
        float(max(weights @ values / weights.sum() for weights in high if weights.any())),
    )


def class_slack(phase: np.ndarray) -> np.ndarray:
    """How many particles (types,) the types may miss of their exact shares; `phase` (types,) is the phase of each.

    The count of a phase is rounded, by half a particle. Its k size classes share it by largest remainder, which is at
    most 1 - 1/k of a particle off (`recipe.particle_counts`).
    """
    classes = np.array([np.sum(phase == each) for each in phase])
    return PHASE_SLACK + 1 - 1 / classes


def exact(value: float, tolerance: float = 0.0) -> Value:
    """A value that no rounding of particle numbers changes, but for a relative `tolerance`."""
    return Value(float(value), float(value * (1 - tolerance)), float(value * (1 + tolerance)))


def quantities(slurry: State) -> dict[str, Value]:
    """All that is compared, by name: size, shape, density and composition of a slurry.

    Number fractions and mean radii are means over particles, each of which counts as one. A phase of which the slurry
    has no particle has a fraction alone.
    """
    edges_um, counts = slurry.edges_um, slurry.counts
    phase = np.array([each.phase for each in slurry.types])
    radius_um = np.array([each.diameter_um / 2 for each in slurry.types])
    slack = class_slack(phase)
    of_phase = {name: phase == name for name in dict.fromkeys(phase.tolist())}
    totals = np.array([counts[of].sum() for of in of_phase.values()])
    values = {
        "particles": exact(counts.sum()),
        "shortest_edge_um": exact(edges_um.min()),
        "longest_edge_um": exact(edges_um.max()),
        "density_g_cm3": exact(slurry.density_g_cm3),
        "thickness_ratio": exact(edges_um[2] / edges_um[0], RATIO_TOLERANCE),
    }
    for is_phase, name in zip(np.eye(len(totals)), of_phase, strict=True):
        values[f"{FRACTION_PREFIX}{name}"] = mean_value(is_phase, totals, np.full(len(totals), PHASE_SLACK))
    values["mean_radius_um"] = mean_value(radius_um, counts, slack)
    for name, of in of_phase.items():
        if counts[of].any():
            values[f"{RADIUS_PREFIX}{name}"] = mean_value(radius_um[of], counts[of], slack[of])
            (density_g_cm3,) = {each.density_g_cm3 for each in slurry.types if each.phase == name}
            values[f"{DENSITY_PREFIX}{name}"] = exact(density_g_cm3)
    return values


@dataclass(frozen=True)
class Range:
    """Least and greatest value of a quantity in training slurries, and the same with room for whole particles."""

    training_min: float
    training_max: float
    low: float
    high: float


NONE_OF_IT = Range(0.0, 0.0, 0.0, 0.0)  # number fraction of a phase that no training slurry has


def training_range(training: Iterable[State], earlier_g_cm3: Sequence[float] = ()) -> dict[str, Range]:
    """Range of each quantity in one or more training slurries.

    `earlier_g_cm3` are their densities at input frames before the last one.
    """
    each = [
        {name: Range(value.value, value.value, value.low, value.high) for name, value in quantities(slurry).items()}
        for slurry in training
    ]
    earlier = [{**each[0], "density_g_cm3": Range(*[float(density)] * 4)} for density in earlier_g_cm3]
    return merged([*each, *earlier])


def merged(ranges: Sequence[Mapping[str, Range]]) -> dict[str, Range]:
    """The range of all training slurries from those of parts of them, by quantity."""
    found = {}
    for name in dict.fromkeys(name for each in ranges for name in each):
        missing = [NONE_OF_IT] if name.startswith(FRACTION_PREFIX) else []
        found[name] = [limits for each in ranges for limits in ([each[name]] if name in each else missing)]
    return {
        name: Range(
            min(each.training_min for each in limits),
            max(each.training_max for each in limits),
            min(each.low for each in limits),
            max(each.high for each in limits),
        )
        for name, limits in found.items()
    }


@dataclass(frozen=True)
class Compared:
    """A quantity of a slurry beside the least and greatest value of the training slurries."""

    value: float
    training_min: float
    training_max: float
    outside: bool


def compare(value: Value, training: Range) -> Compared:
    """Compare a slurry with training slurries; it is outside if their ranges do not meet."""
    outside = value.high < training.low or value.low > training.high
    return Compared(value.value, training.training_min, training.training_max, outside)


def compare_with_training(slurry: State, training: Mapping[str, Range]) -> dict[str, Compared]:
    """Compare each quantity of a slurry with the range of training slurries.

    Of a phase that only one side has, the number fraction is compared.
    """
    values = quantities(slurry)
    fractions = [name for name in (*values, *training) if name.startswith(FRACTION_PREFIX)]
    values |= {name: exact(0.0) for name in fractions if name not in values}
    ranges = {**dict.fromkeys(fractions, NONE_OF_IT), **training}
    return {name: compare(value, ranges[name]) for name, value in values.items() if name in ranges}
