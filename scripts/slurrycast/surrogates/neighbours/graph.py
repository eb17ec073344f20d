"""A slurry as a graph: what the network is told of its particles and of the pairs of neighbours."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slurrycast.data.frames import Frame, Particles
from slurrycast.data.neighbour_search import neighbour_pairs
from slurrycast.runtime.files import InputError

# What the network is fed is of order 1 by these fixed scales. Standardised by the training set, the volume ratio would
# be a name of each slurry, which a network learns by heart.
TYPICAL_RADIUS_UM, RADIUS_RANGE_UM, TYPICAL_CONTACTS, TYPICAL_STEP_UM = 0.4, 0.2, 4.0, 0.05
TYPICAL_SHRINKAGE = 0.1  # of the logarithm of the volume from one frame to the next
INPUTS = ("scalars", "past", "radius_um", "receivers", "senders", "separation_um")
PAIR_INPUTS = ("receivers", "senders", "separation_um")


@dataclass(frozen=True)
class Graph:
    """A slurry as the network sees it, n particles and m directed pairs.

    Attributes
    ----------
    scalars
        (n, phases + 2 frames + 2), in typical values.
    past
        Displacements beyond the affine map in typical values, (n, 3, frames - 1).
    radius_um
        (n,).
    receivers, senders
        Particles of each pair, (m,) each, sorted by receiver.
    separation_um
        From receiver to sender, (m, 3).
    affine_um
        The affine prediction, (n, 3).
    """

    scalars: np.ndarray
    past: np.ndarray
    radius_um: np.ndarray
    receivers: np.ndarray
    senders: np.ndarray
    separation_um: np.ndarray
    affine_um: np.ndarray


def checked_pairs(position_um: np.ndarray, edges_um: np.ndarray, cutoff_um: float) -> tuple[np.ndarray, ...]:
    """Pairs as `neighbour_search.neighbour_pairs` gives them, (m,), (m,) and (m, 3).

    InputError if the cutoff is above half the shortest edge, or so short that there are no pairs.
    """
    if cutoff_um > edges_um.min() / 2:
        raise InputError(
            f"surrogate.neighbours.cutoff_um = {cutoff_um:g}: must be at most {edges_um.min() / 2:.4g}, half the "
            "shortest edge of the final box"
        )
    pairs = neighbour_pairs(position_um, edges_um, cutoff_um)
    if not len(pairs[0]):
        raise InputError(
            f"surrogate.neighbours.cutoff_um = {cutoff_um:g}: must be above the distance of the closest particles, "
            "no two are neighbours"
        )
    return pairs


def scaled_places(frame: Frame) -> np.ndarray:
    """Unwrapped places (n, 3) about the box centre, in box edges."""
    return frame.position_um / frame.edges_um


def slurry_graph(particles: Particles, frames: Sequence[Frame], final_edges_um: np.ndarray, cutoff_um: float) -> Graph:
    """Graph of a slurry.

    Parameters
    ----------
    particles
        n particles.
    frames
        Input frames in their order.
    final_edges_um
        Edges (3,) of the final box.
    cutoff_um
        Largest distance between neighbours in the affine prediction.
    """
    affine_um = np.stack([scaled_places(frame) * final_edges_um for frame in frames], axis=1)
    past_um = np.diff(affine_um, axis=1)
    past_um -= past_um.mean(axis=0)
    receivers, senders, separation_um = checked_pairs(affine_um[:, -1], final_edges_um, cutoff_um)
    log_volumes = [np.log(edges_um).sum() for edges_um in (frames[-2].edges_um, frames[-1].edges_um, final_edges_um)]
    shrinkage = [log_volumes[2] - log_volumes[1], (log_volumes[0] - log_volumes[1]) / TYPICAL_SHRINKAGE]
    scalars = [
        np.eye(len(particles.phase_names))[particles.phase - 1],
        (particles.radius_um[:, None] - TYPICAL_RADIUS_UM) / RADIUS_RANGE_UM,
        np.stack([frame.coordination for frame in frames], axis=1) / TYPICAL_CONTACTS,
        np.linalg.norm(past_um, axis=2) / TYPICAL_STEP_UM,
        np.broadcast_to(shrinkage, (len(particles), 2)),
    ]
    return Graph(
        scalars=np.concatenate(scalars, axis=1).astype(np.float32),
        past=(past_um / TYPICAL_STEP_UM).transpose(0, 2, 1).astype(np.float32),
        radius_um=particles.radius_um.astype(np.float32),
        receivers=receivers.astype(np.int32),
        senders=senders.astype(np.int32),
        separation_um=separation_um.astype(np.float32),
        affine_um=affine_um[:, -1],
    )
