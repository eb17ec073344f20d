"""Message passing between neighbours: what the affine prediction of a slurry has to be moved by, and how sure that is.

A particle of the affine prediction (the last input frame in the final box) hears from all within `cutoff_diameters` of
it, by the nearest periodic image. Nodes know phase, radius, contacts in the input frames, by how far they left the
affine map from each input frame to the next, how much the box has still to shrink and how fast it does; edges know
distance, the gap between surfaces in the box of the time that a layer stands for, and the relative motion. The network
(network.py) answers with a displacement and the logarithm of its variance. Absolute places never enter, and all lengths
are in mean diameters of the slurry's particles.

It learns from whole slurries, from their input frames and from the same number of frames that end up to
`earlier_frames` before these, one of these windows at random in each epoch: the same way to the same end, and as loose
as a slurry is at the input frames that is larger and shrinks later. Each layer but the last is also asked where the
particles are when the box has come so far on its way to the final one, `intermediate targets`: a deep network finds the
whole way from its end alone only slowly, and by the volume, not by the clock, the way of a large slurry is that of a
small one.

`members` networks with different seeds are trained one after the other and stored as one. The prediction is the mean of
the members; its spread per coordinate is made of the variance that they expect and of that between them.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slurrycast.data.trajectories import Trajectory
from slurrycast.runtime.files import InputError
from slurrycast.surrogates.backend import read_model, start_keras
from slurrycast.surrogates.base import MEAN_PACKING_FRACTION, Surrogate
from slurrycast.surrogates.neighbours import targets
from slurrycast.surrogates.neighbours.graph import Graph, mean_diameter_um, slurry_graph
from slurrycast.surrogates.neighbours.training import misfit, network_shape, train
from slurrycast.surrogates.prediction import Prediction, PredictionInput
from slurrycast.surrogates.stored_model import StoredLayer

if TYPE_CHECKING:
    from slurrycast.surrogates.neighbours.network import Ensemble

# In mean diameters.
LEAST_SPREAD, LARGEST_SPREAD = 0.012, 1.2  # of a member: finer is not to be known, a diameter is no place at all
LARGEST_MOVE = 2.4  # of a member: no particle of the training slurries leaves its affine place by more
COMPILED_FROM = 30_000  # particles times members: a compiled prediction takes half as long, but seconds to compile


class Neighbours(Surrogate):
    """An ensemble of networks that pass messages between neighbours."""

    name = "neighbours"
    looks_at = (
        "phase, radius, coordination and past displacements of the particle itself and of its neighbours in the affine "
        "prediction, their distances, and the final box"
    )
    box_rule = MEAN_PACKING_FRACTION
    model_file = "model.keras"
    weights_epoch = "last"
    learns_from = "frames"
    least_frames = 2  # motion is a difference of two
    has_spread = True

    def input_shapes(self, n_frames: int, settings: Mapping) -> dict[str, tuple[int, ...]]:
        """Shape of the input that tells how many frames a network was trained on."""
        return {"past": (3, n_frames - 1)}

    def knows(self, layers: Sequence[StoredLayer]) -> bool:
        """Whether a model has the ensemble of this version, whose lengths are in mean diameters."""
        return any(layer.kind == "Ensemble" and "cutoff" in layer.config.get("shape", ()) for layer in layers)

    def misfit(self, layers: Sequence[StoredLayer], n_frames: int, n_phases: int, settings: Mapping) -> str | None:
        """What of the ensemble of a stored model does not fit; see `training.misfit`."""
        if not self.knows(layers):
            return "is no model of neighbours, or one of an earlier version"
        (ensemble,) = (layer.config for layer in layers if layer.kind == "Ensemble")
        return misfit(ensemble["shape"], ensemble["n_members"], network_shape(settings, n_frames, n_phases), settings)

    needed_frames = staticmethod(targets.needed_frames)

    def first_frame_seen(self, input_frames: Sequence[int], settings: Mapping) -> int:
        """Earliest last input frame among the windows that it learns from."""
        return targets.windows(input_frames, settings["earlier_frames"])[0][-1]

    def train(
        self, data: tuple[Sequence[Trajectory], Sequence[Trajectory]], settings: Mapping, folder: Path
    ) -> dict[str, float]:
        """Train the members; see `training.train`."""
        return train(*data, settings, folder)

    def predict(self, inputs: PredictionInput, model_path: str | Path, settings: Mapping) -> Prediction:
        """Final unwrapped coordinates in um, in the final box of the input, and their spread (n, 3).

        The cutoff is the one that the model was trained with, whatever `settings` say. InputError if
        the file is no model of this kind or does not fit the input.
        """
        ensemble = read_ensemble(model_path, inputs)
        graph = slurry_graph(inputs.particles, inputs.frames, inputs.final_edges_um, ensemble.shape["cutoff"])
        moved, log_variance = answers(ensemble, graph)
        # bounded, since of a neighbourhood unlike all that it learned from a network may expect anything
        length = np.linalg.norm(moved, axis=2, keepdims=True)
        moved = moved * (LARGEST_MOVE / np.maximum(length, LARGEST_MOVE))
        bounds = 2 * np.log(LEAST_SPREAD), 2 * np.log(LARGEST_SPREAD)
        variance = np.exp(np.clip(log_variance, *bounds)).mean(axis=1) + moved.var(axis=1)
        diameter_um = mean_diameter_um(inputs.particles)
        return Prediction(graph.affine_um + diameter_um * moved.mean(axis=1), spread_um=diameter_um * np.sqrt(variance))


def read_ensemble(model_path: str | Path, inputs: PredictionInput) -> "Ensemble":
    """Read the members of a model file. InputError if it is no model of this kind or does not fit the input."""
    start_keras()
    from slurrycast.surrogates.neighbours.network import Ensemble

    model = read_model(model_path)
    ensembles = [layer for layer in model.layers if isinstance(layer, Ensemble)]
    if len(ensembles) != 1:
        raise InputError(f"{model_path}: not a model of neighbours, or one of an earlier version: train it again")
    (ensemble,) = ensembles
    n_scalars, n_past = ensemble.shape["n_scalars"], ensemble.shape["n_past"]
    n_frames, n_phases = len(inputs.frames), n_scalars - 2 * (n_past + 1) - 2
    if n_past != n_frames - 1:
        raise InputError(f"{model_path}: was trained on {n_past + 1} input frames, asked with {n_frames}")
    if n_phases != len(inputs.particles.phase_names):
        known = len(inputs.particles.phase_names)
        raise InputError(f"{model_path}: was trained on {n_phases} phases, slurry {inputs.slurry} has {known}")
    return ensemble


def answers(ensemble: "Ensemble", graph: Graph) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (n, members, 3) and logarithms of variances (n, members, 1) of all members.

    The members answer one after the other, since each needs a GB for 15000 particles, and by one traced graph of
    operations. That takes seconds to make, but unlike layers called one by one it forgets what it needs no more.
    """
    import tensorflow as tf

    from slurrycast.surrogates.neighbours.network import signature, tensors

    members = ensemble.flat_weights()
    answer = tf.function(
        lambda weights, *inputs: ensemble.answer(weights, list(inputs)),
        input_signature=[tf.TensorSpec(members.shape[1:]), *signature(ensemble.network)],
        jit_compile=len(members) * len(graph.radius) > COMPILED_FROM,
    )
    inputs = tensors(graph)
    outputs = [[output.numpy().astype(float) for output in answer(weights, *inputs)] for weights in members]
    return tuple(np.stack(values, axis=1) for values in zip(*outputs, strict=True))
