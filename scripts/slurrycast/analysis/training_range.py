"""The range of the training slurries at the last input frame, and which slurries lie outside it. Pure numpy.

A surrogate interpolates between the slurries that it learned from; of a slurry outside their range it knows nothing.
The densities of earlier input frames, where these slurries were looser, belong to the range.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from slurrycast.data.frames import Particles

# Boxes shrink isotropically, so Lz/Lx stays what it was but for rounding: of sums over each step, and of 15 digits.
RATIO_TOLERANCE = 1e-9
PHASE_SLACK = 0.5  # a phase has the whole number of particles nearest to its share
FRACTION_PREFIX = "fraction_"  # before the name of a phase


@dataclass(frozen=True)
class State:
    """A slurry at its last input frame: `edges_um` (3,) are those of its box."""

    particles: Particles
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


def fraction(particles: Particles, phase: str) -> Value:
    """Number fraction of a phase; every phase of the slurry may have half a particle more or less."""
    counts = np.array([np.sum(particles.in_phase(name)) for name in particles.phase_names])
    is_phase = np.array([float(name == phase) for name in particles.phase_names])
    return mean_value(is_phase, counts, np.full(len(counts), PHASE_SLACK))


def mean_radius_um(particles: Particles, types: np.ndarray) -> Value:
    """Mean radius over the particles, each of which counts as one; `types` as `types_of` returns them."""
    phase, radius_um = types.T
    counts = np.array([np.sum((particles.phase == p) & (particles.radius_um == r)) for p, r in types])
    return mean_value(radius_um, counts, class_slack(phase))


def types_of(slurries: Iterable[Particles]) -> np.ndarray:
    """Phase and radius in um (types, 2) of each type of particle that occurs; a small slurry may lack a rare one."""
    return np.unique(np.concatenate([np.column_stack([each.phase, each.radius_um]) for each in slurries]), axis=0)


def quantities(slurry: State, types: np.ndarray) -> dict[str, Value]:
    """All that is compared, by name: size, shape, density and composition of a slurry."""
    edges_um, particles = slurry.edges_um, slurry.particles
    exact = {
        "particles": len(particles),
        "shortest_edge_um": edges_um.min(),
        "longest_edge_um": edges_um.max(),
        "density_g_cm3": slurry.density_g_cm3,
    }
    values = {name: Value(float(value), float(value), float(value)) for name, value in exact.items()}
    ratio = float(edges_um[2] / edges_um[0])
    values["thickness_ratio"] = Value(ratio, ratio * (1 - RATIO_TOLERANCE), ratio * (1 + RATIO_TOLERANCE))
    values |= {f"{FRACTION_PREFIX}{phase}": fraction(particles, phase) for phase in particles.phase_names}
    values["mean_radius_um"] = mean_radius_um(particles, types)
    return values


@dataclass(frozen=True)
class Compared:
    """A quantity of a slurry beside the least and greatest value of the training slurries."""

    value: float
    training_min: float
    training_max: float
    outside: bool


def compare(value: Value, training: Sequence[Value]) -> Compared:
    """Compare a slurry with the `training` slurries (one or more); it is outside if their ranges do not meet."""
    low, high = min(each.low for each in training), max(each.high for each in training)
    return Compared(
        value.value,
        min(each.value for each in training),
        max(each.value for each in training),
        value.high < low or value.low > high,
    )


def compare_with_training(
    slurry: State, training: Sequence[State], earlier_g_cm3: Sequence[float] = ()
) -> dict[str, Compared]:
    """Compare each quantity of a slurry with the range of the training slurries.

    Parameters
    ----------
    slurry, training
        The slurry, and one or more training slurries.
    earlier_g_cm3
        Densities of the training slurries in g/cm3 at input frames before the last one.
    """
    types = types_of(each.particles for each in (slurry, *training))
    training_quantities = [quantities(each, types) for each in training]
    ranges = {name: [each[name] for each in training_quantities] for name in training_quantities[0]}
    ranges["density_g_cm3"] += [Value(density, density, density) for density in earlier_g_cm3]
    return {name: compare(value, ranges[name]) for name, value in quantities(slurry, types).items()}
