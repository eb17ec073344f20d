"""Measures of a packed structure: contacts, overlaps, packing fractions and the RDF of every pair of phases.

Neighbour searches are freud's, on one thread. freud computes in float32 in a box about the origin: an RDF feels that
only where a distance lies within about 1e-6 um of a bin's edge. Contacts are searched a little further than the
particles reach and then decided in float64, so that they are those of the DEM.
"""

from dataclasses import dataclass
from itertools import combinations_with_replacement

import freud
import numpy as np

from slurrycast.analysis.rdf import MAX_SHARE_OF_EDGE
from slurrycast.data.frames import Particles
from slurrycast.data.periodic import minimum_image, wrap
from slurrycast.dem.recipe import sphere_volume_um3
from slurrycast.runtime.files import InputError

# Share by which contacts are searched further than the largest diameter: far above the rounding of float32.
SEARCH_MARGIN = 1e-3


@dataclass(frozen=True)
class Contacts:
    """Pairs (m,) of touching particles, each pair once: their indices and the distance of their centres in um."""

    first: np.ndarray
    second: np.ndarray
    distance_um: np.ndarray


def phase_pairs(particles: Particles) -> dict[str, tuple[str, str]]:
    """Every unordered pair of phases by its name, `A-A` and `A-B` in the order of the phases.

    Pairs are left out that not even two particles form.
    """
    numbers = {name: int(particles.in_phase(name).sum()) for name in particles.phase_names}
    return {
        f"{a}-{b}": (a, b)
        for a, b in combinations_with_replacement(particles.phase_names, 2)
        if numbers[a] * (numbers[b] - (a == b)) > 0
    }


def _as_freud(position_um: np.ndarray, lower_um: np.ndarray, edges_um: np.ndarray) -> tuple[freud.box.Box, np.ndarray]:
    """Box of freud, and wrapped positions (n, 3) about its centre as float32."""
    centred_um = wrap(position_um, lower_um, edges_um) - (lower_um + edges_um / 2)
    return freud.box.Box(*edges_um), centred_um.astype(np.float32)


def find_contacts(
    position_um: np.ndarray, lower_um: np.ndarray, edges_um: np.ndarray, radius_um: np.ndarray
) -> Contacts:
    """Pairs of spheres with centres (n, 3), which may be unwrapped, that are nearer than their radii (n,) together.

    InputError if the largest sphere would meet its own periodic image.
    """
    widest_um, shortest_um = 2 * float(np.max(radius_um)), float(np.min(edges_um))
    reach_um = (1 + SEARCH_MARGIN) * widest_um
    if reach_um > MAX_SHARE_OF_EDGE * shortest_um:
        raise InputError(f"box edge {shortest_um:g} um: too short for contacts of particles {widest_um:g} um wide")
    box, points = _as_freud(position_um, lower_um, edges_um)
    with freud.parallel.NumThreads(1):
        query = freud.locality.AABBQuery(box, points).query(points, {"r_max": reach_um, "exclude_ii": True})
        neighbours = np.asarray(query.toNeighborList()[:], dtype=np.intp)
    first, second = neighbours[neighbours[:, 0] < neighbours[:, 1]].T
    distance_um = np.linalg.norm(minimum_image(position_um[second] - position_um[first], edges_um), axis=1)
    touching = distance_um < radius_um[first] + radius_um[second]
    return Contacts(first[touching], second[touching], distance_um[touching])


def lens_volume_um3(distance_um: np.ndarray, radius_a_um: np.ndarray, radius_b_um: np.ndarray) -> np.ndarray:
    """Volume that two spheres share, arrays (m,): zero if they do not meet, the smaller sphere if it is inside.

    Otherwise, with d the distance and a, b the radii (Weisstein, Sphere-Sphere Intersection, MathWorld):

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
    """Numbers of one structure with positions (n, 3), which may be unwrapped, in its periodic box.

    particles           n
    density_g_cm3       mass of all particles over the volume of the box
    coordination_all    mean number of contacts of a particle; a contact is a distance below Ri + Rj
    coordination_<A>-<B>    mean number of contacts of an A particle with B particles
    overlap_mean, overlap_max   of 1 - distance / (Ri + Rj) over all contacts, 0 where there is none
    packing_nominal     volumes of all spheres over that of the box
    packing_union       the same less the lenses that touching spheres share. Volume shared by three spheres is taken
                        off once too often, so this is a lower bound; it is near while overlaps are small.
    """
    radius_um = particles.radius_um
    contacts = find_contacts(position_um, lower_um, edges_um, radius_um)
    first, second = contacts.first, contacts.second
    reach_um = radius_um[first] + radius_um[second]
    overlap = 1 - contacts.distance_um / reach_um
    volume_um3 = float(np.prod(edges_um))
    spheres_um3 = float(sphere_volume_um3(2 * radius_um).sum())
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
    return measures | {
        "overlap_mean": float(overlap.mean()) if len(overlap) else 0.0,
        "overlap_max": float(overlap.max(initial=0.0)),
        "packing_nominal": spheres_um3 / volume_um3,
        "packing_union": (spheres_um3 - lenses_um3) / volume_um3,
    }


def radial_distributions(
    position_um: np.ndarray, lower_um: np.ndarray, edges_um: np.ndarray, particles: Particles, r_edges_um: np.ndarray
) -> dict[str, np.ndarray]:
    """g(r) (bins,) of all particles (`all`) and of every pair of `phase_pairs`, in equal bins (bins + 1,) from 0.

    The range must end below half the shortest edge (`rdf.bin_edges_um`). Normalised as `rdf.radial_distribution`;
    counts are those of freud.density.RDF for the pairs, which add up to the one of all particles.
    """
    box, points = _as_freud(position_um, lower_um, edges_um)
    # Of the volume of the box, in each shell: what an ideal gas has of all possible pairs.
    share_of_box = 4 / 3 * np.pi * np.diff(r_edges_um**3) / np.prod(edges_um)
    r_max_um = float(r_edges_um[-1])
    curves = {}
    all_counts = np.zeros(len(r_edges_um) - 1)
    with freud.parallel.NumThreads(1):
        for pair, (a, b) in phase_pairs(particles).items():
            same = a == b
            around, neighbours = points[particles.in_phase(a)], points[particles.in_phase(b)]
            rdf = freud.density.RDF(bins=len(all_counts), r_max=r_max_um)
            rdf.compute((box, neighbours), around, neighbors={"r_max": r_max_um, "exclude_ii": same})
            counts = rdf.bin_counts.astype(np.float64)
            curves[pair] = counts / (len(around) * (len(neighbours) - same) * share_of_box)
            all_counts += counts if same else 2 * counts
    return {"all": all_counts / (len(points) * (len(points) - 1) * share_of_box)} | curves
