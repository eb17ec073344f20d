"""A slurry as a graph: what the network is told of its particles and of the pairs of neighbours.

Lengths are in mean diameters of the slurry's particles: a powder that is coarser throughout looks the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slurrycast.data.frames import Frame, Particles
from slurrycast.data.neighbour_search import neighbour_pairs
from slurrycast.runtime.files import InputError

# What the network is fed is of order 1 by these fixed scales. Standardised by the training set, the volume ratio would
# be a name of each slurry, which a network learns by heart.
TYPICAL_RADIUS, RADIUS_RANGE, TYPICAL_CONTACTS, TYPICAL_STEP = 0.47, 0.235, 4.0, 0.0587
TYPICAL_SHRINKAGE = 0.1  # of the logarithm of the volume from one frame to the next
INPUTS = ("scalars", "past", "radius", "receivers", "senders", "separation")
PAIR_INPUTS = ("receivers", "senders", "separation")


@dataclass(frozen=True)
class Graph:
    """A slurry as the network sees it, n particles and m directed pairs.

    Attributes
    ----------
    scalars
        (n, phases + 2 frames + 2), in typical values.
    past
        Displacements beyond the affine map in typical values, (n, 3, frames - 1).
    radius
        (n,).
    receivers, senders
        Particles of each pair, (m,) each, sorted by receiver.
    separation
        From receiver to sender, (m, 3).
    affine_um
        The affine prediction, (n, 3), in um.
    """

    scalars: np.ndarray
    past: np.ndarray
    radius: np.ndarray
    receivers: np.ndarray
    senders: np.ndarray
    separation: np.ndarray
    affine_um: np.ndarray


def mean_diameter_um(particles: Particles) -> float:
    """Mean diameter over the particles, each of which counts as one: the unit of length of the network."""
    return float(2 * particles.radius_um.mean())


def checked_pairs(position: np.ndarray, edges: np.ndarray, cutoff: float) -> tuple[np.ndarray, ...]:
    """Pairs as `neighbour_search.neighbour_pairs` gives them, (m,), (m,) and (m, 3), all lengths in mean diameters.

    InputError if the cutoff is above half the shortest edge, or so short that there are no pairs.
    """
    if cutoff > edges.min() / 2:
        raise InputError(
            f"surrogate.neighbours.cutoff_diameters = {cutoff:g}: must be at most {edges.min() / 2:.4g}, half the "
            "shortest edge of the final box"
        )
    pairs = neighbour_pairs(position, edges, cutoff)
    if not len(pairs[0]):
        raise InputError(
            f"surrogate.neighbours.cutoff_diameters = {cutoff:g}: must be above the distance of the closest "
            "particles, no two are neighbours"
        )
    return pairs


def scaled_places(frame: Frame) -> np.ndarray:
    """Unwrapped places (n, 3) about the box centre, in box edges."""
    return frame.position_um / frame.edges_um


def slurry_graph(particles: Particles, frames: Sequence[Frame], final_edges_um: np.ndarray, cutoff: float) -> Graph:
    """Graph of a slurry.

    Parameters
    ----------
    particles
        n particles.
    frames
        Input frames in their order.
    final_edges_um
        Edges (3,) of the final box.
    cutoff
        Largest distance between neighbours in the affine prediction, in mean diameters.
    """
    diameter_um = mean_diameter_um(particles)
    radius, final_edges = particles.radius_um / diameter_um, final_edges_um / diameter_um
    affine = np.stack([scaled_places(frame) * final_edges for frame in frames], axis=1)
    past = np.diff(affine, axis=1)
    past -= past.mean(axis=0)
    receivers, senders, separation = checked_pairs(affine[:, -1], final_edges, cutoff)
    log_volumes = [np.log(edges_um).sum() for edges_um in (frames[-2].edges_um, frames[-1].edges_um, final_edges_um)]
    shrinkage = [log_volumes[2] - log_volumes[1], (log_volumes[0] - log_volumes[1]) / TYPICAL_SHRINKAGE]
    scalars = [
        np.eye(len(particles.phase_names))[particles.phase - 1],
        (radius[:, None] - TYPICAL_RADIUS) / RADIUS_RANGE,
        np.stack([frame.coordination for frame in frames], axis=1) / TYPICAL_CONTACTS,
        np.linalg.norm(past, axis=2) / TYPICAL_STEP,
        np.broadcast_to(shrinkage, (len(particles), 2)),
    ]
    return Graph(
        scalars=np.concatenate(scalars, axis=1).astype(np.float32),
        past=(past / TYPICAL_STEP).transpose(0, 2, 1).astype(np.float32),
        radius=radius.astype(np.float32),
        receivers=receivers.astype(np.int32),
        senders=senders.astype(np.int32),
        separation=separation.astype(np.float32),
        affine_um=scaled_places(frames[-1]) * final_edges_um,
    )
