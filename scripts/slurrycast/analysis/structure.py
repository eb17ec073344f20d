"""Measures of a packed structure: contacts, overlaps, packing fractions and the fluctuation of composition.

Neighbours are searched by freud on one thread. It computes in float32, so contacts are searched a little further than
the particles reach and then decided in float64: they are those of the DEM.
"""

from dataclasses import dataclass

import numpy as np

from slurrycast.analysis.coarseness import WINDOWS_UM, coarseness
from slurrycast.analysis.rdf import MAX_SHARE_OF_EDGE, phase_pairs
from slurrycast.data.frames import Particles
from slurrycast.data.neighbour_search import SEARCH_MARGIN, candidate_pairs
from slurrycast.data.periodic import minimum_image
from slurrycast.dem.particles import total_volume_um3
from slurrycast.dem.recipe import sphere_volume_um3
from slurrycast.runtime.files import InputError

# Spheres with fewer contacts are not held in place by their neighbours: three dimensions take four.
FEW_CONTACTS = 4


@dataclass(frozen=True)
class Contacts:
    """Pairs (m,) of touching particles, each pair once: their indices and the distance of their centres in um."""

    first: np.ndarray
    second: np.ndarray
    distance_um: np.ndarray


def find_contacts(
    position_um: np.ndarray, lower_um: np.ndarray, edges_um: np.ndarray, radius_um: np.ndarray
) -> Contacts:
    """Pairs of spheres whose centres are nearer than the sum of their radii.

    Parameters
    ----------
    position_um
        Centres (n, 3) in um, which may be unwrapped.
    lower_um, edges_um
        Lower corner (3,) and edges (3,) of the box in um.
    radius_um
        Radii (n,) in um.

    Raises
    ------
    InputError
        If the largest sphere would meet its own periodic image.
    """
    widest_um, shortest_um = 2 * float(np.max(radius_um)), float(np.min(edges_um))
    reach_um = (1 + SEARCH_MARGIN) * widest_um
    if reach_um > MAX_SHARE_OF_EDGE * shortest_um:
        raise InputError(f"box edge {shortest_um:g} um: too short for contacts of particles {widest_um:g} um wide")
    # Each sphere is searched beside those of its own size class and smaller ones alone: as far as large spheres reach,
    # small ones have thousands of neighbours.
    size_class = np.floor(np.log2(radius_um / np.min(radius_um))).astype(int)
    pairs = []
    for each in np.unique(size_class):
        known = np.flatnonzero(size_class <= each)
        of_class = size_class[known] == each
        reach_um = 2 * float(radius_um[known].max())
        one, other = candidate_pairs(position_um[known], lower_um, edges_um, reach_um, np.flatnonzero(of_class))
        once = ~of_class[other] | (one < other)
        pairs.append(known[np.sort([one[once], other[once]], axis=0)])
    first, second = np.concatenate(pairs, axis=1)
    order = np.lexsort((second, first))
    first, second = first[order], second[order]
    distance_um = np.linalg.norm(minimum_image(position_um[second] - position_um[first], edges_um), axis=1)
    touching = distance_um < radius_um[first] + radius_um[second]
    return Contacts(first[touching], second[touching], distance_um[touching])


def lens_volume_um3(distance_um: np.ndarray, radius_a_um: np.ndarray, radius_b_um: np.ndarray) -> np.ndarray:
    """Volume that two spheres share.

    Parameters
    ----------
    distance_um, radius_a_um, radius_b_um
        Distance of the centres and both radii in um, each (m,) or a number.

    Returns
    -------
    Volume (m,) in um3: 0 if the spheres do not meet, that of the smaller sphere if it lies inside the other one.

    Notes
    -----
    In between, with d the distance and a, b the radii (Weisstein, Sphere-Sphere Intersection, MathWorld):

        V = pi (a + b - d)^2 (d^2 + 2 d (a + b) - 3 (a - b)^2) / (12 d)
    """
    total, difference = radius_a_um + radius_b_um, np.abs(radius_a_um - radius_b_um)
    # Outside [difference, total] the formula at the nearer end is right but for one sphere inside the other, d -> 0.
    d = np.clip(distance_um, np.maximum(difference, np.finfo(float).tiny), total)
    lens = np.pi * (total - d) ** 2 * (d**2 + 2 * d * total - 3 * difference**2) / (12 * d)
    inside = sphere_volume_um3(2 * np.minimum(radius_a_um, radius_b_um))
    return np.where(distance_um <= difference, inside, lens)


def structure_measures(
    position_um: np.ndarray, lower_um: np.ndarray, edges_um: np.ndarray, particles: Particles
) -> dict[str, float]:
    """Quantities of one structure in its periodic box.

    Parameters
    ----------
    position_um
        Positions (n, 3) in um, which may be unwrapped.
    lower_um, edges_um
        Lower corner (3,) and edges (3,) of the box in um.
    particles
        The n particles.

    Returns
    -------
    Numbers by name:

    particles           n
    density_g_cm3       mass of all particles over the volume of the box
    coordination_all    mean number of contacts of a particle; a contact is a distance below Ri + Rj
    coordination_<A>-<B>    mean number of contacts of an A particle with B particles
    share_below_4_contacts  share of the particles with fewer than four contacts, of the number of all
    overlap_mean, overlap_max   of 1 - distance / (Ri + Rj) over all contacts, 0 where there is none
    packing_nominal     volumes of all spheres over that of the box
    packing_union       the same less the lenses that touching spheres share. Volume shared by three spheres is taken
                        off once too often, so this is a lower bound; it is close while overlaps are small.
    coarseness_<w>um_<A>    `coarseness` of phase A in windows of w um, for those of `WINDOWS_UM` that fit

    Raises
    ------
    InputError
        As `find_contacts`.
    """
    radius_um = particles.radius_um
    contacts = find_contacts(position_um, lower_um, edges_um, radius_um)
    first, second = contacts.first, contacts.second
    reach_um = radius_um[first] + radius_um[second]
    overlap = 1 - contacts.distance_um / reach_um
    volume_um3 = float(np.prod(edges_um))
    spheres_um3 = total_volume_um3(particles)
    lenses_um3 = float(lens_volume_um3(contacts.distance_um, radius_um[first], radius_um[second]).sum())
    measures = {
        "particles": float(len(particles)),
        "density_g_cm3": float(particles.mass_pg.sum() / volume_um3),
        "coordination_all": 2 * len(first) / len(particles),
    }
    for pair, names in phase_pairs(particles).items():
        a, b = (particles.in_phase(name) for name in names)
        # From both ends of each contact; that of two A particles is one more for each of them.
        ends = np.sum(a[first] & b[second]) + np.sum(a[second] & b[first])
        measures[f"coordination_{pair}"] = float(ends / a.sum())
    contacts_of_each = np.bincount(np.concatenate([first, second]), minlength=len(particles))
    fluctuations = {
        f"coarseness_{window_um:g}um_{phase}": value
        for window_um in WINDOWS_UM
        for phase, value in coarseness(position_um, lower_um, edges_um, particles, window_um).items()
    }
    of_contacts = {
        f"share_below_{FEW_CONTACTS}_contacts": float(np.mean(contacts_of_each < FEW_CONTACTS)),
        "overlap_mean": float(overlap.mean()) if len(overlap) else 0.0,
        "overlap_max": float(overlap.max(initial=0.0)),
        "packing_nominal": spheres_um3 / volume_um3,
        "packing_union": (spheres_um3 - lenses_um3) / volume_um3,
    }
    return measures | of_contacts | fluctuations
