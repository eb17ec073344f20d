"""Pair coefficients of the overlaid Lennard-Jones and granular Hertz forces, and the time steps they allow."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations_with_replacement

import numpy as np

from slurrycast.dem.recipe import ParticleType

POISSON_RATIO = 0.3  # enters the Rayleigh time alone; usual for oxides
BOLTZMANN_FJ_K = 1.3806504e-8  # of LAMMPS' units micro


def _pairs(types: Sequence[ParticleType]) -> Iterator[tuple[int, int, float, float]]:
    """Type numbers i <= j with the arithmetic and the geometric mean of their diameters in um."""
    for a, b in combinations_with_replacement(types, 2):
        mean = (a.diameter_um + b.diameter_um) / 2
        yield a.type, b.type, mean, float(np.sqrt(a.diameter_um * b.diameter_um))


def largest_cutoff_um(types: Sequence[ParticleType], lennard_jones: Mapping) -> float:
    """Longest range of any pair force in um."""
    return max(lennard_jones["cutoff_factor"], 1.0) * max(t.diameter_um for t in types)


def coefficients(types: Sequence[ParticleType], lennard_jones: Mapping) -> str:
    """LAMMPS `pair_coeff` lines for every i <= j.

    Parameters
    ----------
    types
        All particle types.
    lennard_jones
        Section force_field.lennard_jones of the configuration.

    Notes
    -----
    Hybrid styles do not mix missing cross terms, so each pair is written out: eps_ij = e sqrt(d_i d_j) in fJ, sigma_ij
    and cutoff as multiples of d_ij = (d_i + d_j) / 2 in um. The Hertz parameters are those of the pair style, the same
    for all pairs.
    """
    lines = ["# pair_coeff i j style epsilon(fJ) sigma(um) cutoff(um)", "pair_coeff * * gran/hertz/history"]
    lines += [
        f"pair_coeff {i} {j} lj/cut {lennard_jones['epsilon_fj_per_um'] * geometric:.10g}"
        f" {lennard_jones['sigma_factor'] * mean:.10g} {lennard_jones['cutoff_factor'] * mean:.10g}"
        for i, j, mean, geometric in _pairs(types)
    ]
    return "\n".join(lines) + "\n"


def push_off_coefficients(types: Sequence[ParticleType]) -> str:
    """LAMMPS `pair_coeff` lines of `pair_style soft`, with which overlaps are removed before real forces act.

    E = A (1 + cos(pi r / d_ij)), zero at contact. A = 1 fJ has no effect on the result: only the direction of the
    forces steers the minimiser.
    """
    lines = ["# pair_coeff i j prefactor(fJ) cutoff(um)"]
    lines += [f"pair_coeff {i} {j} 1.0 {mean:.10g}" for i, j, mean, _ in _pairs(types)]
    return "\n".join(lines) + "\n"


def thermal_share(temperature_k: float, pressure_kpa: float, volume_um3: float) -> float:
    """k T over pressure x volume per particle; 1 kPa um3 = 1 fJ."""
    return BOLTZMANN_FJ_K * temperature_k / (pressure_kpa * volume_um3)


def rayleigh_time_us(types: Sequence[ParticleType], normal_stiffness_kpa: float) -> float:
    """Shortest Rayleigh time of any particle type in us.

    Parameters
    ----------
    types
        All particle types.
    normal_stiffness_kpa
        k_n of the Hertzian contact.

    Notes
    -----
    T_R = pi R sqrt(rho / G) / (0.1631 nu + 0.8766) (Thornton & Randall 1988), with nu = 0.3 and the shear modulus
    G = 3/4 (1 - nu) k_n that follows from k_n = 4/3 E* of equal materials. kPa = pg/(um us2), so units cancel.
    """
    shear_modulus_kpa = 0.75 * (1 - POISSON_RATIO) * normal_stiffness_kpa
    return min(np.pi * t.diameter_um / 2 * np.sqrt(t.density_g_cm3 / shear_modulus_kpa) for t in types) / (
        0.1631 * POISSON_RATIO + 0.8766
    )


def hertz_time_us(types: Sequence[ParticleType], normal_stiffness_kpa: float, impact_speed_um_us: float) -> float:
    """Shortest duration of a Hertzian contact of any pair in us.

    Parameters
    ----------
    types
        All particle types.
    normal_stiffness_kpa
        k_n of the Hertzian contact.
    impact_speed_um_us
        Relative speed v of the two particles.

    Notes
    -----
    T_H = 2.87 (m_eff^2 / (R_eff E*^2 v))^(1/5) (Johnson, Contact Mechanics, 1985, sect. 11.4) with E* = 3/4 k_n.
    """
    times = []
    for a, b in combinations_with_replacement(types, 2):
        mass_pg = a.mass_pg * b.mass_pg / (a.mass_pg + b.mass_pg)
        radius_um = a.diameter_um * b.diameter_um / (a.diameter_um + b.diameter_um) / 2
        modulus_kpa = 0.75 * normal_stiffness_kpa
        times.append(2.87 * (mass_pg**2 / (radius_um * modulus_kpa**2 * impact_speed_um_us)) ** 0.2)
    return min(times)
