"""What the network learns: by how much the particles of a slurry have to be moved, on the way and at the end.

Every slurry gives several examples: its input frames, and the same number of frames that end up to `earlier_frames`
before. Intermediate targets are places at times when the box has gone a share of its way to the final one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slurrycast.data.trajectories import Trajectory
from slurrycast.runtime.files import InputError
from slurrycast.surrogates.neighbours.graph import Graph, mean_diameter_um, scaled_places, slurry_graph


@dataclass(frozen=True)
class Example:
    """A slurry to learn from.

    Attributes
    ----------
    graph
        The slurry as the network sees it.
    moved
        By how much its particles have to be moved, (stages, n, 3), in mean diameters. The last stage is the end, those
        before are intermediate targets.
    diameter_um
        Mean diameter of its particles.
    """

    graph: Graph
    moved: np.ndarray
    diameter_um: float

    @property
    def size(self) -> tuple[int, int]:
        """Numbers of particles and of pairs."""
        return len(self.graph.radius), len(self.graph.receivers)

    def arrays(self) -> list[np.ndarray]:
        """All arrays that it consists of."""
        return [*vars(self.graph).values(), self.moved]


def windows(input_frames: Sequence[int], earlier_frames: int) -> list[list[int]]:
    """The input frames, and these moved by up to `earlier_frames`, as far as they lie in the run."""
    moved = [[k - shift for k in input_frames] for shift in range(earlier_frames, -1, -1)]
    return [frames for frames in moved if frames[0] >= 0]


@dataclass(frozen=True)
class Stage:
    """A time between two frames that follow each other: `part` of the way from the one before to the one after."""

    before: int
    after: int
    part: float


def stages(edges_um: Mapping[int, np.ndarray], last_frame: int, settings: Mapping) -> list[Stage]:
    """Times of the intermediate targets after the last input frame, and of the target.

    An intermediate target is reached when the logarithm of the volume has first gone that share of its way to the
    target frame. `edges_um` are the edges (3,) of the box at all frames.
    """
    target = settings["target_frame"]
    log_volumes = {k: np.log(edges_um[k]).sum() for k in range(last_frame, target + 1)}
    start, end = log_volumes[last_frame], log_volumes[target]
    share = {
        k: (value - start) / (end - start) if end != start else float(k > last_frame)
        for k, value in log_volumes.items()
    }
    reached = []
    for way in settings["intermediate_targets"]:
        after = next(k for k in share if share[k] >= way)
        before = after - 1
        reached.append(Stage(before, after, (way - share[before]) / (share[after] - share[before])))
    return [*reached, Stage(target, target, 1.0)]


def layer_shares(settings: Mapping) -> list[float]:
    """Share of its way at which the box is after each layer; at least that of the first intermediate target."""
    ends = [*settings["intermediate_targets"], 1.0]
    return [ends[0]] * (settings["layers"] - len(ends)) + ends


def needed_frames(settings: Mapping, edges_um: Mapping[int, np.ndarray], *, moved: bool = True) -> list[int]:
    """Numbers of all frames that learning reads, or testing where the input frames are not `moved`.

    `edges_um` are the edges (3,) of the box at all frames in their order. InputError if the target frame is none of
    them.
    """
    target = settings["target_frame"]
    if target not in edges_um:
        raise InputError(f"frame {target} is not among the frames {min(edges_um)} to {max(edges_um)}")
    numbers = set()
    for frames in windows(settings["input_frames"], settings["earlier_frames"] if moved else 0):
        ends = stages(edges_um, frames[-1], settings)
        numbers.update(frames, (stage.before for stage in ends), (stage.after for stage in ends))
    return sorted(numbers)


def make_example(trajectory: Trajectory, input_frames: Sequence[int], settings: Mapping) -> Example:
    """Make the example of a slurry with these input frames, in its true final box."""
    frames = [trajectory.frames[k] for k in input_frames]
    final_edges_um = trajectory.edges_um[settings["target_frame"]]
    graph = slurry_graph(trajectory.particles, frames, final_edges_um, settings["cutoff_diameters"])
    ends = [
        (1 - stage.part) * scaled_places(trajectory.frames[stage.before])
        + stage.part * scaled_places(trajectory.frames[stage.after])
        for stage in stages(trajectory.edges_um, input_frames[-1], settings)
    ]
    moved_um = np.stack([end * final_edges_um - graph.affine_um for end in ends])
    moved_um -= moved_um.mean(axis=1, keepdims=True)  # a common shift has no meaning in a periodic box
    diameter_um = mean_diameter_um(trajectory.particles)
    return Example(graph, (moved_um / diameter_um).astype(np.float32), diameter_um)
