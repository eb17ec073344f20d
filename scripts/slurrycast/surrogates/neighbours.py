"""Message passing between neighbours: what the affine prediction of a slurry has to be moved by, and how sure that is.

A particle of the affine prediction (the last input frame in the final box) hears from all within `cutoff_um` of it, by
the nearest periodic image. Nodes know phase, radius, contacts in the input frames, by how far they left the affine map
from each input frame to the next, how much the box has still to shrink and how fast it does; edges know distance, gap
and the relative motion. The network (neighbour_network.py) answers with a displacement in um and the logarithm of its
variance. Absolute places never enter.

It learns from whole slurries, from their input frames and from the same number of frames that end up to `shift_frames`
earlier or later, one of these at random in each epoch: the same way to the same end, seen from other places on it. Each
layer but the last is also asked where the particles are at a frame on that way, `waypoints` after the last input frame:
a deep network finds the whole way from its end alone only slowly.

`members` networks with seeds of their own are trained one after the other and stored as one. The prediction is their
mean; its spread per coordinate is made of the variance that they expect and of that between them.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slurrycast.files import InputError, RunError, moved_into_place, write_text
from slurrycast.frames import Frame, Particles
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
from slurrycast.trajectories import Trajectory

if TYPE_CHECKING:
    import keras
    import tensorflow as tf

NAME = "neighbours"
LOOKS_AT = (
    "phase, radius, coordination and past displacements of the particle itself and of its neighbours in the affine "
    "prediction, their distances, and the final box"
)
BOX_RULE = "mean_packing_fraction"
MODEL_FILE = "model.keras"
LEARNS_FROM = "frames"
CONTINUES_DEM = False
HAS_SPREAD = True
VARIANT = None

# What the network is fed is of order 1 by these fixed scales. Standardised by the training set, the volume ratio would
# be a name of each slurry, which a network learns by heart.
TYPICAL_RADIUS_UM, RADIUS_RANGE_UM, TYPICAL_CONTACTS, TYPICAL_STEP_UM = 0.4, 0.2, 4.0, 0.05
WARM_UP = 0.15  # share of the steps over which the learning rate rises; then it falls as a cosine
TYPICAL_SHRINKAGE = 0.1  # of the logarithm of the volume from one frame to the next
GRADIENT_NORM = 1.0
WAYPOINT_WEIGHT = 0.3  # of the squared error at each of them, beside that at the end
DOUBT_WEIGHT = 0.01  # of the likelihood of the variance, which has a head of its own, beside the squared error in um2
INPUTS = ("scalars", "past", "radius_um", "receivers", "senders", "separation_um")


def input_shapes(n_frames: int, settings: Mapping) -> dict[str, tuple[int, ...]]:
    """Shape of the input that tells how many frames a network was trained on."""
    return {"past": (3, n_frames - 1)}


@dataclass(frozen=True)
class Graph:
    """A slurry as the network sees it, n particles and m directed pairs.

    scalars (n, phases + 2 frames + 2) and past (n, 3, frames - 1), displacements beyond the affine map, in typical
    values; radius_um (n,); receivers and senders (m,), sorted by receiver; separation_um (m, 3) from receiver to
    sender; affine_um (n, 3), the affine prediction.
    """

    scalars: np.ndarray
    past: np.ndarray
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


def scaled_places(frame: Frame) -> np.ndarray:
    """Unwrapped places (n, 3) about the box centre, in box edges."""
    return frame.position_um / frame.edges_um


def graph(particles: Particles, frames: Sequence[Frame], final_edges_um: np.ndarray, cutoff_um: float) -> Graph:
    """Graph of a slurry from its input frames, in their order, and the edges (3,) of its final box in um."""
    affine_um = np.stack([scaled_places(frame) * final_edges_um for frame in frames], axis=1)
    past_um = np.diff(affine_um, axis=1)
    past_um -= past_um.mean(axis=0)
    receivers, senders, separation_um = neighbour_pairs(affine_um[:, -1], final_edges_um, cutoff_um)
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


@dataclass(frozen=True)
class Lesson:
    """A slurry to learn from: its graph, and by how much it has to be moved, (stages, n, 3) in um.

    The last stage is the end, those before are waypoints.
    """

    seen: Graph
    moved_um: np.ndarray

    def arrays(self) -> list[np.ndarray]:
        """All that it consists of."""
        return [*vars(self.seen).values(), self.moved_um]


def windows(input_frames: Sequence[int], shift_frames: int, target_frame: int) -> list[list[int]]:
    """The input frames, and these moved by up to `shift_frames`, as far as they lie in the run before the target."""
    moved = [[k + shift for k in input_frames] for shift in range(-shift_frames, shift_frames + 1)]
    return [frames for frames in moved if frames[0] >= 0 and frames[-1] < target_frame]


def stages(settings: Mapping) -> list[int]:
    """Frames of the waypoints that lie before the target, and the target; one for each of the last layers."""
    last, target = settings["input_frames"][-1], settings["target_frame"]
    on_the_way = [last + after for after in settings["waypoints"] if last + after < target]
    return [*on_the_way, target][-settings["layers"] :]


def needed_frames(settings: Mapping, *, moved: bool = True) -> list[int]:
    """Numbers of all frames that learning reads, or testing where the input frames are not moved."""
    shift, target = settings["shift_frames"] if moved else 0, settings["target_frame"]
    inputs = (k for frames in windows(settings["input_frames"], shift, target) for k in frames)
    return sorted({*stages(settings), *inputs})


def lesson(trajectory: Trajectory, input_frames: Sequence[int], settings: Mapping) -> Lesson:
    """What is to be learned from a slurry when these are its input frames, in its true final box."""
    ends = [trajectory.frames[k] for k in stages(settings)]
    frames = [trajectory.frames[k] for k in input_frames]
    final_edges_um = ends[-1].edges_um
    seen = graph(trajectory.particles, frames, final_edges_um, settings["cutoff_um"])
    moved_um = np.stack([scaled_places(end) * final_edges_um - seen.affine_um for end in ends])
    moved_um -= moved_um.mean(axis=1, keepdims=True)  # a common shift has no meaning in a periodic box
    return Lesson(seen, moved_um.astype(np.float32))


def _inputs(seen: Graph) -> list["tf.Tensor"]:
    import tensorflow as tf

    return [tf.constant(getattr(seen, name)) for name in INPUTS]


def _signature(network: "keras.Model") -> list["tf.TensorSpec"]:
    """What it takes, for any number of particles: one trace for each would make rounding depend on their order."""
    import tensorflow as tf

    return [tf.TensorSpec((None, *entry.shape[1:]), entry.dtype) for entry in network.inputs]


def _train_member(
    number: int,
    shape: Mapping,
    lessons: Sequence[Sequence[Lesson]],
    tests: Sequence[Lesson],
    settings: Mapping,
    work: Path,
) -> tuple["keras.Model", Progress]:
    """Train one member, whose seed follows from the run's, or go on with it.

    `lessons` are those of each training slurry, one for each of its windows of input frames.
    """
    import keras
    import tensorflow as tf

    from slurrycast.surrogates import neighbour_network

    seed, epochs, name = derived_seed(settings["seed"], f"member {number}"), settings["epochs"], f"{NAME} {number}"
    keras.utils.set_random_seed(seed)
    network = neighbour_network.build(**shape, name=f"member{number}")
    optimizer = keras.optimizers.AdamW(settings["learning_rate"], settings["weight_decay"], clipnorm=GRADIENT_NORM)
    optimizer.build(network.trainable_variables)
    state = {"weights": network.trainable_variables, "optimizer": optimizer.variables}
    arrays = [array for lesson in (*(one for own in lessons for one in own), *tests) for array in lesson.arrays()]
    identity = fingerprint(arrays, {**settings, "member": number})
    checkpoint, progress = work / f"checkpoint_{number}.h5", Progress()
    if found := read_checkpoint(checkpoint, identity, name):
        then, progress = found
        for key, variables in state.items():
            for variable, value in zip(variables, then[key], strict=True):
                variable.assign(value)

    signature = _signature(network)

    @tf.function(input_signature=signature)
    def answer(*inputs):
        return network(list(inputs), training=False)

    n_stages = len(lessons[0][0].moved_um)
    by_layer = neighbour_network.by_layer(network, n_stages)

    @tf.function(input_signature=[tf.TensorSpec((n_stages, None, 3)), *signature])
    def step(targets_um, *inputs):
        with tf.GradientTape() as tape:
            moved_um, log_variance = by_layer(list(inputs), training=True)
            errors_um = moved_um - targets_um
            loss = tf.reduce_mean(errors_um[-1] ** 2)
            on_the_way = tf.reduce_sum(tf.reduce_mean(errors_um[:-1] ** 2, axis=(1, 2)))
            error_um = tf.stop_gradient(errors_um[-1])
            doubt = tf.reduce_mean(log_variance + error_um**2 * tf.exp(-log_variance))
            total = loss + WAYPOINT_WEIGHT * on_the_way + DOUBT_WEIGHT * doubt
        gradients = tape.gradient(total, network.trainable_variables)
        optimizer.apply_gradients(zip(gradients, network.trainable_variables, strict=True))
        return loss, tf.reduce_mean(tf.abs(errors_um[-1]))

    sizes = [len(own[0].seen.radius_um) for own in lessons]
    n_steps, start, first = epochs * len(lessons), time.monotonic(), len(progress.history)
    for epoch in range(first + 1, epochs + 1):
        draw = np.random.default_rng((seed, epoch))
        losses = np.zeros((len(lessons), 2))
        for place, k in enumerate(draw.permutation(len(lessons))):
            drawn = lessons[k][draw.integers(len(lessons[k]))]
            share = ((epoch - 1) * len(lessons) + place) / n_steps
            optimizer.learning_rate.assign(settings["learning_rate"] * learning_rate_share(share))
            losses[k] = step(tf.constant(drawn.moved_um), *_inputs(drawn.seen))
        errors_um = [(answer(*_inputs(test.seen))[0] - test.moved_um[-1]).numpy() for test in tests]
        # each slurry counts as much, so that the largest does not decide alone
        of_tests = [[np.mean(own**2), np.mean(abs(own))] for own in errors_um] or [[np.nan, np.nan]]
        row = np.array([*np.average(losses, axis=0, weights=sizes), *np.mean(of_tests, axis=0)])
        if not np.isfinite(row[: 4 if tests else 2]).all():
            raise RunError(
                f"{NAME}: the loss is not finite in epoch {epoch}, "
                f"learning_rate {settings['learning_rate']} is too large"
            )
        progress.history.append(row)
        left_s = (time.monotonic() - start) / (epoch - first) * (epochs - epoch)
        said = f"loss {row[0]:.4g} val_loss {row[2]:.4g}"
        print(f"[{name}] epoch {epoch}/{epochs} {said}, {left_s:.0f} s left", flush=True)
        now = {key: [variable.numpy() for variable in variables] for key, variables in state.items()}
        write_checkpoint(checkpoint, identity, now, progress)
    return network, progress


def learning_rate_share(share: float) -> float:
    """Learning rate as a share of its highest, after `share` of the steps: up in a line, down as a cosine."""
    if share < WARM_UP:
        return share / WARM_UP
    return 0.5 * (1 + np.cos(np.pi * (share - WARM_UP) / (1 - WARM_UP)))


def fit(
    slurries: Sequence[Trajectory],
    validation: Sequence[Trajectory],
    settings: Mapping,
    model_path: str | Path,
    history_path: str | Path,
    work_directory: str | Path,
) -> dict[str, float]:
    """Train the members and write them as one model; history.csv holds the mean of their losses at each epoch.

    Mean squared error of the displacement, one slurry a step, in float32; the expected variance learns beside it, by
    its likelihood. The weights are those of the last epoch, at which the learning rate has come to nothing: the
    `validation` slurries are looked at, not chosen by. Without any, their columns of history.csv are empty. `settings`:
    members, epochs, learning_rate, weight_decay, layers, width, vectors, cutoff_um, shift_frames, waypoints,
    input_frames, target_frame, threads, seed; the same seed gives the same result on the same machine. A checkpoint in
    `work_directory`, written after each epoch, of the same settings and data is continued as if there had been no
    break. InputError for a cutoff above half a box edge, RunError if the loss is not finite.
    """
    make_deterministic(settings["seed"], settings["threads"])
    from slurrycast.surrogates import neighbour_network

    own_windows = windows(settings["input_frames"], settings["shift_frames"], settings["target_frame"])
    lessons = [[lesson(slurry, frames, settings) for frames in own_windows] for slurry in slurries]
    tests = [lesson(slurry, settings["input_frames"], settings) for slurry in validation]
    shape = {
        "n_scalars": lessons[0][0].seen.scalars.shape[1],
        "n_past": lessons[0][0].seen.past.shape[2],
        "n_layers": settings["layers"],
        "width": settings["width"],
        "n_vectors": settings["vectors"],
        "cutoff_um": settings["cutoff_um"],
    }
    members, histories, earlier = [], [], {"wall_s": 0.0, "cpu_s": 0.0}
    for number in range(1, settings["members"] + 1):
        network, progress = _train_member(number, shape, lessons, tests, settings, Path(work_directory))
        members.append(network)
        histories.append(progress.history)
        earlier = {clock: max(earlier[clock], progress.earlier[clock]) for clock in earlier}
    rows = [
        ",".join([str(epoch), *("" if np.isnan(value) else repr(float(value)) for value in row)])
        for epoch, row in enumerate(np.mean(histories, axis=0), start=1)
    ]
    write_text(history_path, "\n".join(["epoch,loss,mae,val_loss,val_mae", *rows, ""]))
    with moved_into_place(model_path) as part:
        neighbour_network.joined(members).save(part)
    for checkpoint in Path(work_directory).glob("checkpoint_*.h5"):
        checkpoint.unlink()
    return earlier


def _answers(model: "keras.Model", seen: Graph) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (n, members, 3) in um and logarithms of variances (n, members, 1) of all members.

    One after the other, since each needs a GB for 15000 particles, and all by one traced graph of operations, which
    takes seconds to make and, other than the layers called one by one, forgets what it needs no more.
    """
    import keras
    import tensorflow as tf

    members = [layer for layer in model.layers if isinstance(layer, keras.Model)]
    network = members[0]
    own = [[weight.numpy() for weight in member.weights] for member in members]
    answer = tf.function(lambda *inputs: network(list(inputs), training=False), input_signature=_signature(network))
    inputs, answers = _inputs(seen), []
    for weights in own:
        for weight, value in zip(network.weights, weights, strict=True):
            weight.assign(value)
        answers.append([output.numpy().astype(float) for output in answer(*inputs)])
    return tuple(np.stack(outputs, axis=1) for outputs in zip(*answers, strict=True))


def predict(question: Question, model_path: str | Path, settings: Mapping) -> Prediction:
    """Final unwrapped coordinates in um, in the final box of the question, and their spread (n, 3).

    InputError if the file is no model of this kind or does not fit the question.
    """
    start_keras()
    import keras

    from slurrycast.surrogates import neighbour_network  # noqa: F401 - registers its layers

    try:
        model = keras.saving.load_model(model_path, compile=False, safe_mode=True)
        n_scalars, n_past = model.inputs[0].shape[1], model.inputs[1].shape[2]
    except (OSError, ValueError, TypeError, IndexError) as error:
        raise InputError(f"{model_path}: not a readable Keras model ({str(error).splitlines()[0]})") from error
    n_frames, n_phases = len(question.frames), n_scalars - 2 * (n_past + 1) - 2
    if n_past != n_frames - 1:
        raise InputError(f"{model_path}: was trained on {n_past + 1} input frames, asked with {n_frames}")
    if n_phases != len(question.particles.phase_names):
        known = len(question.particles.phase_names)
        raise InputError(f"{model_path}: was trained on {n_phases} phases, slurry {question.slurry} has {known}")
    seen = graph(question.particles, question.frames, question.final_edges_um, settings["cutoff_um"])
    moved_um, log_variance = _answers(model, seen)
    variance_um2 = np.exp(log_variance).mean(axis=1) + moved_um.var(axis=1)
    return Prediction(seen.affine_um + moved_um.mean(axis=1), spread_um=np.sqrt(variance_um2))
