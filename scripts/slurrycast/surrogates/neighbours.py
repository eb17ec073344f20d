"""Message passing between neighbours: what the affine prediction of a slurry has to be moved by, and how sure that is.

A particle of the affine prediction (the last input frame in the final box) hears from all within `cutoff_um` of it, by
the nearest periodic image. Nodes know phase, radius, contacts in the input frames, by how far they left the affine map
from each input frame to the next, and how much the box has still to shrink; edges know distance, gap and the relative
motion. The network (neighbour_network.py) answers with a displacement in um and the logarithm of its variance.
Absolute places never enter.

`members` networks with seeds of their own are trained one after the other and stored as one. The prediction is their
mean; its spread per coordinate is made of the variance that they expect and of that between them.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slurrycast.dataset import TrainingSet
from slurrycast.features import FEATURE_NAMES, particle_history
from slurrycast.files import InputError, RunError, moved_into_place, write_text
from slurrycast.recipe import derived_seed
from slurrycast.surrogates import start_keras
from slurrycast.surrogates.checkpoint import (
    Progress,
    fingerprint,
    make_deterministic,
    read_checkpoint,
    write_checkpoint,
)
from slurrycast.surrogates.question import Prediction, Question

if TYPE_CHECKING:
    import keras

NAME = "neighbours"
LOOKS_AT = (
    "phase, radius, coordination and past displacements of the particle itself and of its neighbours in the affine "
    "prediction, their distances, and the final box"
)
BOX_RULE = "mean_packing_fraction"
MODEL_FILE = "model.keras"
CONTINUES_DEM = False
VARIANT = None

_PHASE, _RADIUS = (FEATURE_NAMES.index(name) for name in ("phase", "radius_um"))
_COORDINATION = FEATURE_NAMES.index("coordination")
_PLACE = slice(FEATURE_NAMES.index("x_um"), FEATURE_NAMES.index("z_um") + 1)
# What the network is fed is of order 1 by these fixed scales. Standardised by the training set, the volume ratio would
# be a name of each slurry, which a network learns by heart.
TYPICAL_RADIUS_UM, RADIUS_RANGE_UM, TYPICAL_CONTACTS, TYPICAL_STEP_UM = 0.4, 0.2, 4.0, 0.05
WARM_UP = 0.15  # share of the steps over which the learning rate rises; then it falls as a cosine
GRADIENT_NORM = 1.0
DOUBT_WEIGHT = 0.01  # of the likelihood of the variance, which has a head of its own, beside the squared error in um2
INPUTS = ("scalars", "vectors", "radius_um", "receivers", "senders", "separation_um")


@dataclass(frozen=True)
class Graph:
    """A slurry as the network sees it, n particles and m directed pairs.

    scalars (n, phases + 2 frames + 1) and vectors (n, 3, frames - 1) in typical values, radius_um (n,), receivers and
    senders (m,), sorted by receiver, separation_um (m, 3) from receiver to sender; affine_um (n, 3), the affine
    prediction.
    """

    scalars: np.ndarray
    vectors: np.ndarray
    radius_um: np.ndarray
    receivers: np.ndarray
    senders: np.ndarray
    separation_um: np.ndarray
    affine_um: np.ndarray


def neighbour_pairs(position_um: np.ndarray, edges_um: np.ndarray, cutoff_um: float) -> tuple[np.ndarray, ...]:
    """Receivers (m,), senders (m,) and separations (m, 3) of all ordered pairs closer than the cutoff, sorted.

    Positions (n, 3) in a periodic box with edges (3,); InputError if the cutoff is above half the shortest edge, where
    a particle would have to hear from two images of another.
    """
    from scipy.spatial import cKDTree

    if cutoff_um > edges_um.min() / 2:
        raise InputError(
            f"surrogate.neighbours.cutoff_um = {cutoff_um:g}: must be at most {edges_um.min() / 2:.4g}, half the "
            "shortest edge of the final box"
        )
    inside_um = np.mod(position_um, edges_um)
    inside_um[inside_um >= edges_um] = 0.0  # a rounded -1e-17
    pairs = cKDTree(inside_um, boxsize=edges_um).query_pairs(cutoff_um, output_type="ndarray")
    receivers, senders = np.concatenate([pairs, pairs[:, ::-1]]).T
    order = np.lexsort((senders, receivers))
    receivers, senders = receivers[order], senders[order]
    separation_um = inside_um[senders] - inside_um[receivers]
    return receivers, senders, separation_um - edges_um * np.round(separation_um / edges_um)


def graph(
    history: np.ndarray, edges_um: np.ndarray, final_edges_um: np.ndarray, n_phases: int, cutoff_um: float
) -> Graph:
    """Graph of a slurry: features (n, frames, 6), box edges (frames, 3) and those of the final box (3,); um."""
    affine_um = history[..., _PLACE] / edges_um * final_edges_um
    past_um = np.diff(affine_um, axis=1)
    past_um -= past_um.mean(axis=0)
    phases = history[:, 0, _PHASE].astype(int)
    if phases.max() > n_phases:
        raise InputError(f"surrogate neighbours: phase {phases.max()} is not known, it was trained on {n_phases}")
    receivers, senders, separation_um = neighbour_pairs(affine_um[:, -1], final_edges_um, cutoff_um)
    scalars = [
        np.eye(n_phases)[phases - 1],
        (history[:, :1, _RADIUS] - TYPICAL_RADIUS_UM) / RADIUS_RANGE_UM,
        history[..., _COORDINATION] / TYPICAL_CONTACTS,
        np.linalg.norm(past_um, axis=2) / TYPICAL_STEP_UM,
        np.full((len(history), 1), np.log(final_edges_um / edges_um[-1]).sum()),
    ]
    return Graph(
        scalars=np.concatenate(scalars, axis=1).astype(np.float32),
        vectors=(past_um / TYPICAL_STEP_UM).transpose(0, 2, 1).astype(np.float32),
        radius_um=history[:, 0, _RADIUS].astype(np.float32),
        receivers=receivers.astype(np.int32),
        senders=senders.astype(np.int32),
        separation_um=separation_um.astype(np.float32),
        affine_um=affine_um[:, -1],
    )


def _slurries(training_set: TrainingSet, settings: Mapping) -> list[tuple[Graph, np.ndarray, np.ndarray]]:
    """Graph, displacement (n, 3) from the affine prediction in the true final box, and validation mask of each."""
    n_phases = int(training_set.features[:, 0, _PHASE].max())
    slurries = []
    for number in range(len(training_set.slurries)):
        own = training_set.slurry_index == number
        edges = training_set.input_edges_um[number], training_set.target_edges_um[number]
        seen = graph(training_set.features[own], *edges, n_phases, settings["cutoff_um"])
        moved_um = training_set.targets[own] - seen.affine_um
        moved_um -= moved_um.mean(axis=0)  # a common shift has no meaning in a periodic box
        slurries.append((seen, moved_um.astype(np.float32), training_set.is_validation[own]))
    return slurries


def _inputs(seen: Graph) -> list:
    import tensorflow as tf

    return [tf.constant(getattr(seen, name)) for name in INPUTS]


def _train_member(
    number: int, shape: Mapping, slurries: list[tuple[Graph, np.ndarray, np.ndarray]], settings: Mapping, work: Path
) -> tuple["keras.Model", Progress]:
    """Train one member, whose seed follows from the run's, or go on with it."""
    import keras
    import tensorflow as tf

    from slurrycast.surrogates import neighbour_network

    seed, epochs, name = derived_seed(settings["seed"], f"member {number}"), settings["epochs"], f"{NAME} {number}"
    keras.utils.set_random_seed(seed)
    network = neighbour_network.build(**shape, name=f"member{number}")
    optimizer = keras.optimizers.AdamW(settings["learning_rate"], settings["weight_decay"], clipnorm=GRADIENT_NORM)
    optimizer.build(network.trainable_variables)
    state = {"weights": network.trainable_variables, "optimizer": optimizer.variables}
    arrays = [array for seen, *others in slurries for array in (*vars(seen).values(), *others)]
    identity = fingerprint(arrays, {**settings, "member": number})
    checkpoint, progress = work / f"checkpoint_{number}.h5", Progress()
    if found := read_checkpoint(checkpoint, identity, name):
        then, progress = found
        for key, variables in state.items():
            for variable, value in zip(variables, then[key], strict=True):
                variable.assign(value)

    @tf.function(reduce_retracing=True)
    def answer(*inputs):
        return network(list(inputs), training=False)

    @tf.function(reduce_retracing=True)
    def step(target_um, trained, *inputs):
        with tf.GradientTape() as tape:
            moved_um, log_variance = network(list(inputs), training=True)
            error_um = tf.boolean_mask(moved_um - target_um, trained)
            log_variance = tf.boolean_mask(log_variance, trained)
            loss = tf.reduce_mean(error_um**2)
            doubt = tf.reduce_mean(log_variance + tf.stop_gradient(error_um) ** 2 * tf.exp(-log_variance))
            total = loss + DOUBT_WEIGHT * doubt
        gradients = tape.gradient(total, network.trainable_variables)
        optimizer.apply_gradients(zip(gradients, network.trainable_variables, strict=True))
        return loss, tf.reduce_mean(tf.abs(error_um))

    data = [(_inputs(seen), tf.constant(moved_um), held) for seen, moved_um, held in slurries]
    n_trained = np.array([np.sum(~held) for _, _, held in data])
    n_steps, start, first = epochs * len(data), time.monotonic(), len(progress.history)
    for epoch in range(first + 1, epochs + 1):
        order = np.random.default_rng((seed, epoch)).permutation(len(data))
        losses = np.zeros((len(data), 2))
        for place, k in enumerate(order):
            inputs, target_um, held = data[k]
            share = ((epoch - 1) * len(data) + place) / n_steps
            optimizer.learning_rate.assign(settings["learning_rate"] * learning_rate_share(share))
            losses[k] = step(target_um, tf.constant(~held), *inputs)
        errors_um = np.concatenate([(answer(*inputs)[0] - target_um).numpy()[held] for inputs, target_um, held in data])
        validation = [np.mean(errors_um**2), np.mean(abs(errors_um))]
        row = np.array([*np.average(losses, axis=0, weights=n_trained), *validation])
        if not np.isfinite(row).all():
            raise RunError(
                f"{NAME}: the loss is not finite in epoch {epoch}, "
                f"learning_rate {settings['learning_rate']} is too large"
            )
        if not progress.history or row[2] < min(earlier[2] for earlier in progress.history):
            progress.best = [variable.numpy() for variable in network.trainable_variables]
        progress.history.append(row)
        left_s = (time.monotonic() - start) / (epoch - first) * (epochs - epoch)
        losses = f"loss {row[0]:.4g} val_loss {row[2]:.4g}"
        print(f"[{name}] epoch {epoch}/{epochs} {losses}, {left_s:.0f} s left", flush=True)
        now = {key: [variable.numpy() for variable in variables] for key, variables in state.items()}
        write_checkpoint(checkpoint, identity, now, progress)
    for variable, value in zip(network.trainable_variables, progress.best, strict=True):
        variable.assign(value)
    return network, progress


def learning_rate_share(share: float) -> float:
    """Learning rate as a share of its highest, after `share` of the steps: up in a line, down as a cosine."""
    if share < WARM_UP:
        return share / WARM_UP
    return 0.5 * (1 + np.cos(np.pi * (share - WARM_UP) / (1 - WARM_UP)))


def fit(
    training_set: TrainingSet,
    settings: Mapping,
    model_path: str | Path,
    history_path: str | Path,
    work_directory: str | Path,
) -> dict[str, float]:
    """Train the members and write them as one model; history.csv holds the mean of their losses at each epoch.

    Mean squared error of the displacement, one slurry a step, in float32; the expected variance learns beside it, by
    its likelihood. Each member keeps the weights of the epoch with the lowest validation loss. `settings`: members,
    epochs, learning_rate, weight_decay, layers, width, cutoff_um, threads, seed; the same seed gives the same result on
    the same machine. A checkpoint in `work_directory`, written after each epoch, of the same settings and data is
    continued as if there had been no break. InputError for a cutoff above half a box edge, RunError if the loss is not
    finite.
    """
    make_deterministic(settings["seed"], settings["threads"])
    from slurrycast.surrogates import neighbour_network

    slurries = _slurries(training_set, settings)
    shape = {
        "n_scalars": slurries[0][0].scalars.shape[1],
        "n_vectors": slurries[0][0].vectors.shape[2],
        "n_layers": settings["layers"],
        "width": settings["width"],
        "cutoff_um": settings["cutoff_um"],
    }
    members, histories, earlier = [], [], {"wall_s": 0.0, "cpu_s": 0.0}
    for number in range(1, settings["members"] + 1):
        network, progress = _train_member(number, shape, slurries, settings, Path(work_directory))
        members.append(network)
        histories.append(progress.history)
        earlier = {clock: max(earlier[clock], progress.earlier[clock]) for clock in earlier}
    rows = (",".join([str(epoch), *map(repr, map(float, row))]) for epoch, row in enumerate(np.mean(histories, 0), 1))
    write_text(history_path, "\n".join(["epoch,loss,mae,val_loss,val_mae", *rows, ""]))
    with moved_into_place(model_path) as part:
        neighbour_network.joined(members).save(part)
    for checkpoint in Path(work_directory).glob("checkpoint_*.h5"):
        checkpoint.unlink()
    return earlier


def predict(question: Question, model_path: str | Path, settings: Mapping) -> Prediction:
    """Final unwrapped coordinates in um, in the final box of the question, and their spread (n, 3).

    InputError if the file is no model of this kind or does not fit the question.
    """
    start_keras()
    import keras

    from slurrycast.surrogates import neighbour_network  # noqa: F401 - registers its layers

    try:
        model = keras.saving.load_model(model_path, compile=False, safe_mode=True)
        n_scalars, n_vectors = model.inputs[0].shape[1], model.inputs[1].shape[2]
    except (OSError, ValueError, TypeError, IndexError) as error:
        raise InputError(f"{model_path}: not a readable Keras model ({str(error).splitlines()[0]})") from error
    history = particle_history(question.particles, question.frames)
    n_frames = len(question.frames)
    n_phases = n_scalars - 2 * n_frames - 1
    if n_vectors != n_frames - 1 or n_phases < 1:
        raise InputError(f"{model_path}: was trained on {n_vectors + 1} input frames, asked with {n_frames}")
    edges_um = np.array([frame.edges_um for frame in question.frames])
    seen = graph(history, edges_um, question.final_edges_um, n_phases, settings["cutoff_um"])
    moved_um, log_variance = (output.numpy().astype(float) for output in model(_inputs(seen), training=False))
    variance_um2 = np.exp(log_variance).mean(axis=1) + moved_um.var(axis=1)
    return Prediction(seen.affine_um + moved_um.mean(axis=1), spread_um=np.sqrt(variance_um2))
