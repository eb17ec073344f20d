"""Pair coefficients of the overlaid Lennard-Jones and granular Hertz forces, and the time steps they allow."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations_with_replacement

import numpy as np

from slurrycast.dem.neighbour_lists import commands
from slurrycast.dem.recipe import ParticleType

# The parameters of LAMMPS' contact model, which holds one set of them.
CONTACT = (
    "normal_stiffness_kpa",
    "tangential_stiffness_ratio",
    "normal_damping_per_um_us",
    "tangential_damping_ratio",
    "friction",
)
POISSON_RATIO = 0.3  # enters the Rayleigh time alone; usual for oxides
BOLTZMANN_FJ_K = 1.3806504e-8  # of LAMMPS' units micro


def _pairs(types: Sequence[ParticleType]) -> Iterator[tuple[ParticleType, ParticleType, float]]:
    """Types i <= j with the mean of their diameters in um."""
    for a, b in combinations_with_replacement(types, 2):
        yield a, b, (a.diameter_um + b.diameter_um) / 2


def of_pair(force_field: Mapping, phase: str, other: str) -> dict:
    """The parameters of all forces between particles of two phases, which may be one.

    Parameters
    ----------
    force_field
        Section force_field of the configuration; what its `pairs` names goes before lennard_jones and granular_hertz.
    phase, other
        The phases, in any order.
    """
    pairs = force_field.get("pairs", {})
    own = pairs.get(f"{phase}-{other}", pairs.get(f"{other}-{phase}", {}))
    return {**force_field["lennard_jones"], **force_field["granular_hertz"], **own}


def _contact(parameters: Mapping) -> tuple[float, ...]:
    return tuple(parameters[name] for name in CONTACT)


def _contacts(types: Sequence[ParticleType], force_field: Mapping) -> list[tuple[float, ...]]:
    """The different sets of contact parameters of all pairs, in the order of the pairs."""
    pairs = combinations_with_replacement(types, 2)
    return list(dict.fromkeys(_contact(of_pair(force_field, a.phase, b.phase)) for a, b in pairs))


def contact_styles(types: Sequence[ParticleType], force_field: Mapping) -> str:
    """LAMMPS' contact model with its parameters, once for each set of them, as `pair_style hybrid/overlay` takes it.

    Parameters
    ----------
    types
        All particle types.
    force_field
        Section force_field of the configuration.
    """
    return " ".join(
        f"gran/hertz/history {stiffness_kpa} {ratio * stiffness_kpa} {damping} {damping_ratio * damping} {friction} 1"
        for stiffness_kpa, ratio, damping, damping_ratio, friction in _contacts(types, force_field)
    )


def largest_cutoff_um(types: Sequence[ParticleType], lennard_jones: Mapping) -> float:
    """Longest range of any pair force in um."""
    return max(lennard_jones["cutoff_factor"], 1.0) * max(t.diameter_um for t in types)


def coefficients(types: Sequence[ParticleType], force_field: Mapping) -> str:
    """LAMMPS `pair_coeff` lines for every i <= j, and before them the neighbour lists of a wide range of sizes.

    Parameters
    ----------
    types
        All particle types.
    force_field
        Section force_field of the configuration.

    Notes
    -----
    Hybrid styles do not mix missing cross terms, so each pair is written out: eps_ij = e sqrt(d_i d_j) in fJ, sigma_ij
    and cutoff as multiples of d_ij = (d_i + d_j) / 2 in um. The Hertz parameters are those of the pair style: pairs
    name the one of `contact_styles` that is theirs, if there are several.
    """
    contacts = _contacts(types, force_field)
    lines = [*commands(types), "# pair_coeff i j style epsilon(fJ) sigma(um) cutoff(um)"]
    lines += ["pair_coeff * * gran/hertz/history"] if len(contacts) == 1 else []
    for a, b, mean in _pairs(types):
        forces = of_pair(force_field, a.phase, b.phase)
        epsilon_fj = forces["epsilon_fj_per_um"] * float(np.sqrt(a.diameter_um * b.diameter_um))
        if len(contacts) > 1:
            lines.append(f"pair_coeff {a.type} {b.type} gran/hertz/history {contacts.index(_contact(forces)) + 1}")
        lines.append(
            f"pair_coeff {a.type} {b.type} lj/cut {epsilon_fj:.10g}"
            f" {forces['sigma_factor'] * mean:.10g} {forces['cutoff_factor'] * mean:.10g}"
        )
    return "\n".join(lines) + "\n"


def push_off_coefficients(types: Sequence[ParticleType]) -> str:
    """LAMMPS `pair_coeff` lines of `pair_style soft`, with which overlaps are removed before real forces act.

    E = A (1 + cos(pi r / d_ij)), zero at contact. A = 1 fJ has no effect on the result: only the direction of the
    forces steers the minimiser.
    """
    lines = ["# pair_coeff i j prefactor(fJ) cutoff(um)"]
    lines += [f"pair_coeff {a.type} {b.type} 1.0 {mean:.10g}" for a, b, mean in _pairs(types)]
    return "\n".join(lines) + "\n"


def thermal_share(temperature_k: float, pressure_kpa: float, volume_um3: float) -> float:
    """k T over pressure x volume per particle; 1 kPa um3 = 1 fJ."""
    return BOLTZMANN_FJ_K * temperature_k / (pressure_kpa * volume_um3)


def rayleigh_times_us(types: Sequence[ParticleType], force_field: Mapping) -> dict[tuple[int, ...], float]:
    """Rayleigh time of each particle type in us, by its place in `types`.

    Parameters
    ----------
    types
        All particle types.
    force_field
        Section force_field of the configuration.

    Notes
    -----
    T_R = pi R sqrt(rho / G) / (0.1631 nu + 0.8766) (Thornton & Randall 1988), with nu = 0.3 and the shear modulus
    G = 3/4 (1 - nu) k_n that follows from k_n = 4/3 E* of equal materials. kPa = pg/(um us2), so units cancel. k_n is
    that of the stiffest contacts that the type has.
    """
    times = {}
    for k, t in enumerate(types):
        stiffness_kpa = max(of_pair(force_field, t.phase, other.phase)["normal_stiffness_kpa"] for other in types)
        shear_modulus_kpa = 0.75 * (1 - POISSON_RATIO) * stiffness_kpa
        surface_wave_us = np.pi * t.diameter_um / 2 * np.sqrt(t.density_g_cm3 / shear_modulus_kpa)
        times[(k,)] = float(surface_wave_us / (0.1631 * POISSON_RATIO + 0.8766))
    return times


def hertz_times_us(
    types: Sequence[ParticleType], force_field: Mapping, impact_speed_um_us: float
) -> dict[tuple[int, ...], float]:
    """Duration of a Hertzian contact of each pair of particle types in us, by their places in `types`.

    Parameters
    ----------
    types
        All particle types.
    force_field
        Section force_field of the configuration.
    impact_speed_um_us
        Relative speed v of the two particles.

    Notes
    -----
    T_H = 2.87 (m_eff^2 / (R_eff E*^2 v))^(1/5) (Johnson, Contact Mechanics, 1985, sect. 11.4) with E* = 3/4 k_n, that
    of the pair.
    """
    times = {}
    for places in combinations_with_replacement(range(len(types)), 2):
        a, b = (types[k] for k in places)
        mass_pg = a.mass_pg * b.mass_pg / (a.mass_pg + b.mass_pg)
        radius_um = a.diameter_um * b.diameter_um / (a.diameter_um + b.diameter_um) / 2
        modulus_kpa = 0.75 * of_pair(force_field, a.phase, b.phase)["normal_stiffness_kpa"]
        times[places] = 2.87 * (mass_pg**2 / (radius_um * modulus_kpa**2 * impact_speed_um_us)) ** 0.2
    return times
