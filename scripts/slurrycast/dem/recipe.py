"""From weight fractions and size classes to whole particles, and from particles to a starting box. Pure numpy."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np


def sphere_volume_um3(diameter_um: float | np.ndarray) -> float | np.ndarray:
    """Volume of a sphere, or of each of several."""
    return np.pi / 6 * diameter_um**3


@dataclass(frozen=True)
class ParticleType:
    """A size class of a phase: one LAMMPS atom type. `type`, `phase_index` and `size_class` count from 1."""

    type: int
    phase: str
    phase_index: int
    size_class: int
    diameter_um: float
    density_g_cm3: float
    mass_fraction: float  # of its phase in the slurry
    number_fraction: float  # of its class in the phase

    @property
    def volume_um3(self) -> float:
        """Volume of one particle in um3."""
        return sphere_volume_um3(self.diameter_um)

    @property
    def mass_pg(self) -> float:
        """Mass of one particle in pg; 1 g/cm3 = 1 pg/um3."""
        return self.density_g_cm3 * self.volume_um3


def particle_types(phases: Mapping) -> list[ParticleType]:
    """List the particle types of `formulation.phases` in the order of the configuration."""
    type_numbers = itertools.count(1)
    return [
        ParticleType(
            type=next(type_numbers),
            phase=phase,
            phase_index=index,
            size_class=number,
            density_g_cm3=settings["density_g_cm3"],
            mass_fraction=settings["mass_fraction"],
            **size_class,
        )
        for index, (phase, settings) in enumerate(phases.items(), 1)
        for number, size_class in enumerate(settings["size_classes"], 1)
    ]


def _whole_shares(total: int, shares: Sequence[float]) -> np.ndarray:
    """Split `total` into whole numbers nearest to `shares` (largest remainder), so that they sum to `total`."""
    exact = total * np.asarray(shares) / np.sum(shares)
    whole = np.floor(exact).astype(int)
    # stable sort: equal remainders go to the first class, so that the result does not depend on the platform
    by_remainder = np.argsort(whole - exact, kind="stable")
    whole[by_remainder[: total - whole.sum()]] += 1
    return whole


def particle_counts(types: Sequence[ParticleType], mass_pg: float) -> np.ndarray:
    """Number of particles of each type in a slurry.

    Parameters
    ----------
    types
        All particle types.
    mass_pg
        Mass of the slurry.

    Returns
    -------
    Whole numbers (types,).

    Notes
    -----
    A phase of weight fraction w and mean particle mass m (over its number fractions) gets the whole number nearest to
    w mass_pg / m; its classes share that number by number fraction.
    """
    counts = np.zeros(len(types), dtype=int)
    for index in sorted({t.phase_index for t in types}):
        members = [i for i, t in enumerate(types) if t.phase_index == index]
        shares = [types[i].number_fraction for i in members]
        mean_mass_pg = np.average([types[i].mass_pg for i in members], weights=shares)
        total = round(types[members[0]].mass_fraction * mass_pg / mean_mass_pg)
        counts[members] = _whole_shares(total, shares)
    return counts


def mass_fractions(types: Sequence[ParticleType], counts: np.ndarray) -> dict[str, float]:
    """Mass fraction of each phase in a slurry with these numbers of particles (types,)."""
    masses = counts * np.array([t.mass_pg for t in types])
    phases = dict.fromkeys(t.phase for t in types)
    return {phase: float(masses[[t.phase == phase for t in types]].sum() / masses.sum()) for phase in phases}


def mean_volume_um3(types: Sequence[ParticleType], counts: np.ndarray) -> float:
    """Mean volume in um3 of a particle in a slurry with these numbers of particles (types,)."""
    return float(np.average([t.volume_um3 for t in types], weights=counts))


def box_edges_um(volume_um3: float, thickness_ratio: float) -> np.ndarray:
    """Edges (3,) in um of a box with a square base, Lz = `thickness_ratio` Lx, and the given volume."""
    base = np.cbrt(volume_um3 / thickness_ratio)
    return np.array([base, base, thickness_ratio * base])


def random_positions_um(count: int, edges_um: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Uniform random positions (count, 3) in um in a box centred at the origin; particles may overlap."""
    return (rng.random((count, 3)) - 0.5) * edges_um


def derived_seed(seed: int, purpose: str) -> int:
    """A seed for one purpose (1 to 2^31 - 1, as LAMMPS wants it), derived from a slurry's or run's own seed."""
    entropy = [seed, *purpose.encode()]
    return int(np.random.SeedSequence(entropy).generate_state(1, np.uint32)[0] % (2**31 - 1)) + 1


def random_start(inputs: Mapping, purpose: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The particles of a slurry at random places in the box in which its DEM starts.

    Parameters
    ----------
    inputs
        Content of inputs.json.
    purpose
        What the places are for: they follow from it and the seed of the slurry.

    Returns
    -------
    LAMMPS atom types (n,), rising; positions (n, 3) in um about the box centre, where particles may overlap; and the
    edges (3,) in um.
    """
    formulation, row, types = inputs["physics"]["formulation"], inputs["physics"]["slurry"], inputs["types"]
    counts = np.array([t["particles"] for t in types])
    volume_um3 = float(counts @ [sphere_volume_um3(t["diameter_um"]) for t in types])
    edges_um = box_edges_um(volume_um3 / formulation["initial_packing_fraction"], row["thickness_ratio"])
    rng = np.random.default_rng(derived_seed(row["seed"], purpose))
    type = np.repeat([t["type"] for t in types], counts)
    return type, random_positions_um(len(type), edges_um, rng), edges_um
