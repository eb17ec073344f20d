"""Message passing between neighbours: what the affine prediction of a slurry has to be moved by, and how sure that is.

A particle of the affine prediction (the last input frame in the final box) hears from all within `cutoff_um` of it, by
the nearest periodic image. Nodes know phase, radius, contacts in the input frames, by how far they left the affine map
from each input frame to the next, how much the box has still to shrink and how fast it does; edges know distance, the
gap between surfaces in the box of the time that a layer stands for, and the relative motion. The network
(neighbour_network.py) answers with a displacement in um and the logarithm of its variance. Absolute places never enter.

It learns from whole slurries, from their input frames and from the same number of frames that end up to
`earlier_frames` before these, one of these windows at random in each epoch: the same way to the same end, and as loose
as a slurry is at the input frames that is larger and shrinks later. Each layer but the last is also asked where the
particles are when the box has come so far on its way to the final one, `intermediate targets`: a deep network finds the
whole way from its end alone only slowly, and by the volume, not by the clock, the way of a large slurry is that of a
small one.

`members` networks with seeds of their own are trained one after the other and stored as one. The prediction is their
mean; its spread per coordinate is made of the variance that they expect and of that between them.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slurrycast.data.frames import Frame, Particles
from slurrycast.data.trajectories import Trajectory
from slurrycast.dem.recipe import derived_seed
from slurrycast.runtime.files import InputError, RunError, moved_into_place, write_text
from slurrycast.surrogates import start_keras
from slurrycast.surrogates.checkpoint import (
    Progress,
    fingerprint,
    make_deterministic,
    read_checkpoint,
    write_checkpoint,
)
from slurrycast.surrogates.prediction import Prediction, PredictionInput

if TYPE_CHECKING:
    import keras
    import tensorflow as tf

    from slurrycast.surrogates.neighbour_network import Ensemble

NAME = "neighbours"
LOOKS_AT = (
    "phase, radius, coordination and past displacements of the particle itself and of its neighbours in the affine "
    "prediction, their distances, and the final box"
)
BOX_RULE = "mean_packing_fraction"
MODEL_FILE = "model.keras"
MODEL_LAYER = "Ensemble"  # what a model file of this kind holds
WEIGHTS_OF = "last"
LEARNS_FROM = "frames"
LEAST_FRAMES = 2  # of the input: motion is a difference of two
CONTINUES_DEM = None
HAS_SPREAD = True
VARIANT = None

# What the network is fed is of order 1 by these fixed scales. Standardised by the training set, the volume ratio would
# be a name of each slurry, which a network learns by heart.
TYPICAL_RADIUS_UM, RADIUS_RANGE_UM, TYPICAL_CONTACTS, TYPICAL_STEP_UM = 0.4, 0.2, 4.0, 0.05
WARM_UP = 0.15  # share of the steps over which the learning rate rises; then it falls as a cosine
TYPICAL_SHRINKAGE = 0.1  # of the logarithm of the volume from one frame to the next
GRADIENT_NORM = 1.0
INTERMEDIATE_WEIGHT = 0.3  # of the squared error at each of them, beside that at the end
DOUBT_WEIGHT = 0.01  # of the likelihood of the variance, which has a head of its own, beside the squared error in um2
INPUTS = ("scalars", "past", "radius_um", "receivers", "senders", "separation_um")
OF_PAIRS = ("receivers", "senders", "separation_um")
LEAST_SPREAD_UM, LARGEST_SPREAD_UM = 0.01, 1.0  # of a member: finer is not to be known, a diameter is no place at all
LARGEST_MOVE_UM = 2.0  # of a member: no particle of the training slurries leaves its affine place by more
COMPILED_FROM = 30_000  # particles times members: a compiled prediction takes half as long, but seconds to compile
SHAPE_RATIO = 1.5  # of sizes for which a step is compiled: a compilation takes as long as some 20 steps
# Weights learn by Muon, which makes every direction of a step equally long and needs fewer steps than Adam; but the
# layers that take the inputs in or give the variance, and biases and norms, learn by Adam at this share of the rate.
LEARN_BY_ADAM = ("state", "vectors", "doubt", "log_variance")
ADAM_SHARE = 0.3


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
    a particle would have to hear from two images of another, or so short that there are no pairs.
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
    if not len(pairs):
        raise InputError(
            f"surrogate.neighbours.cutoff_um = {cutoff_um:g}: must be above the distance of the closest particles, "
            "no two are neighbours"
        )
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
class Example:
    """A slurry to learn from: its graph, and by how much it has to be moved, (stages, n, 3) in um.

    The last stage is the end, those before are intermediate targets.
    """

    seen: Graph
    moved_um: np.ndarray

    @property
    def size(self) -> tuple[int, int]:
        """Numbers of particles and of pairs."""
        return len(self.seen.radius_um), len(self.seen.receivers)

    def arrays(self) -> list[np.ndarray]:
        """All that it consists of."""
        return [*vars(self.seen).values(), self.moved_um]


def windows(input_frames: Sequence[int], earlier_frames: int) -> list[list[int]]:
    """The input frames, and these moved by up to `earlier_frames`, as far as they lie in the run."""
    moved = [[k - shift for k in input_frames] for shift in range(earlier_frames, -1, -1)]
    return [frames for frames in moved if frames[0] >= 0]


def first_frame_seen(input_frames: Sequence[int], settings: Mapping) -> int:
    """The earliest last input frame among the windows that it learns from."""
    return windows(input_frames, settings["earlier_frames"])[0][-1]


@dataclass(frozen=True)
class Stage:
    """A time between two frames that follow each other: `part` of the way from the one before to the one after."""

    before: int
    after: int
    part: float


def stages(edges_um: Mapping[int, np.ndarray], last_frame: int, settings: Mapping) -> list[Stage]:
    """When the intermediate targets after the last input frame are reached, and the target.

    An intermediate target is reached when the logarithm of the volume has first gone that share of its way to the
    target frame; `edges_um` (3,) of the box at all frames.
    """
    target = settings["target_frame"]
    log_volumes = {k: np.log(edges_um[k]).sum() for k in range(last_frame, target + 1)}
    start, end = log_volumes[last_frame], log_volumes[target]
    share = {
        k: (value - start) / (end - start) if end != start else float(k > last_frame)
        for k, value in log_volumes.items()
    }
    found = []
    for way in settings["intermediate_targets"]:
        after = next(k for k in share if share[k] >= way)
        before = after - 1
        found.append(Stage(before, after, (way - share[before]) / (share[after] - share[before])))
    return [*found, Stage(target, target, 1.0)]


def layer_shares(settings: Mapping) -> list[float]:
    """Share of its way at which the box is after each layer; at least that of the first intermediate target."""
    ends = [*settings["intermediate_targets"], 1.0]
    return [ends[0]] * (settings["layers"] - len(ends)) + ends


def needed_frames(settings: Mapping, edges_um: Mapping[int, np.ndarray], *, moved: bool = True) -> list[int]:
    """Numbers of all frames that learning reads, or testing where the input frames are not moved.

    `edges_um` (3,) of the slurry's box at all frames, in their order; InputError if the target frame is none of them.
    """
    target = settings["target_frame"]
    if target not in edges_um:
        raise InputError(f"frame {target} is not among the frames {min(edges_um)} to {max(edges_um)}")
    found = set()
    for frames in windows(settings["input_frames"], settings["earlier_frames"] if moved else 0):
        ends = stages(edges_um, frames[-1], settings)
        found.update(frames, (stage.before for stage in ends), (stage.after for stage in ends))
    return sorted(found)


def example(trajectory: Trajectory, input_frames: Sequence[int], settings: Mapping) -> Example:
    """What is to be learned from a slurry when these are its input frames, in its true final box."""
    frames = [trajectory.frames[k] for k in input_frames]
    final_edges_um = trajectory.edges_um[settings["target_frame"]]
    seen = graph(trajectory.particles, frames, final_edges_um, settings["cutoff_um"])
    ends = [
        (1 - stage.part) * scaled_places(trajectory.frames[stage.before])
        + stage.part * scaled_places(trajectory.frames[stage.after])
        for stage in stages(trajectory.edges_um, input_frames[-1], settings)
    ]
    moved_um = np.stack([end * final_edges_um - seen.affine_um for end in ends])
    moved_um -= moved_um.mean(axis=1, keepdims=True)  # a common shift has no meaning in a periodic box
    return Example(seen, moved_um.astype(np.float32))


def shapes(sizes: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """A few (particles, pairs) of which one is at least as large as each of these `sizes`, from small to large.

    The largest one, and that divided by powers of `SHAPE_RATIO`, as far as any slurry needs it.
    """
    largest, smallest = np.max(sizes, axis=0), np.min(sizes, axis=0)
    n_shapes = 1 + int(np.log((largest / smallest).min()) / np.log(SHAPE_RATIO))
    ratios = SHAPE_RATIO ** -np.arange(n_shapes)[::-1, None]
    known = [tuple(int(n) for n in shape) for shape in np.ceil(largest * ratios)]
    return [shape for shape in known if any(_fitting(size, known) == shape for size in sizes)]


def _fitting(size: tuple[int, int], known: Sequence[tuple[int, int]]) -> tuple[int, int]:
    return next(shape for shape in known if size[0] <= shape[0] and size[1] <= shape[1])


def filled(one: Example, known: Sequence[tuple[int, int]], cutoff_um: float) -> Example:
    """The same with particles and pairs added up to the first of the `known` shapes that it fits in.

    The pairs that are added join the last particle to itself, from so far that it hears nothing; the particles have no
    pairs, or only those.
    """
    n, m = (to - size for to, size in zip(_fitting(one.size, known), one.size, strict=True))
    last = one.size[0] + n - 1
    seen = {
        name: np.pad(value, [(0, m if name in OF_PAIRS else n), *[(0, 0)] * (value.ndim - 1)])
        for name, value in vars(one.seen).items()
    }
    for name, value in zip(OF_PAIRS, (last, last, 2 * cutoff_um), strict=True):
        seen[name][one.size[1] :] = value
    return Example(Graph(**seen), np.pad(one.moved_um, [(0, 0), (0, n), (0, 0)]))


def _inputs(seen: Graph) -> list["tf.Tensor"]:
    import tensorflow as tf

    return [tf.constant(getattr(seen, name)) for name in INPUTS]


def _signature(network: "keras.Model") -> list["tf.TensorSpec"]:
    """What it takes, for any number of particles: one trace for each would make rounding depend on their order."""
    import tensorflow as tf

    return [tf.TensorSpec((None, *entry.shape[1:]), entry.dtype) for entry in network.inputs]


class _Training:
    """One network, its optimizer and a compiled step, in which all members learn, one after the other."""

    def __init__(self, shape: Mapping, n_stages: int, settings: Mapping) -> None:
        import keras
        import tensorflow as tf

        from slurrycast.surrogates import neighbour_network

        self.shape, self.settings = shape, settings
        self.network = network = neighbour_network.build(**shape, name="learner")
        self.optimizer = optimizer = keras.optimizers.Muon(
            settings["learning_rate"],
            adam_lr_ratio=ADAM_SHARE,
            weight_decay=settings["weight_decay"],
            adam_weight_decay=settings["weight_decay"],
            exclude_layers=[f"(^|/){name}(/|$)" for name in LEARN_BY_ADAM],
            clipnorm=GRADIENT_NORM,
        )
        optimizer.build(network.trainable_variables)
        self.state = {"weights": network.trainable_variables, "optimizer": optimizer.variables}
        self.fresh = [variable.numpy() for variable in optimizer.variables]
        signature = _signature(network)
        by_layer = neighbour_network.by_layer(network, n_stages)

        @tf.function(input_signature=signature)
        def answer(*inputs):
            return network(list(inputs), training=False)

        # as one program of machine code a step takes half as long as operation by operation
        @tf.function(
            input_signature=[tf.TensorSpec((), "int32"), tf.TensorSpec((n_stages, None, 3)), *signature],
            jit_compile=True,
        )
        def step(n_particles, targets_um, *inputs):
            there = tf.cast(tf.range(tf.shape(targets_um)[1]) < n_particles, tf.float32)[:, None]
            n_coordinates = 3.0 * tf.cast(n_particles, tf.float32)
            with tf.GradientTape() as tape:
                moved_um, log_variance = by_layer(list(inputs), training=True)
                errors_um = (moved_um - targets_um) * there
                losses = tf.reduce_sum(errors_um**2, axis=(1, 2)) / n_coordinates
                error_um = tf.stop_gradient(errors_um[-1])
                doubt = (log_variance + error_um**2 * tf.exp(-log_variance)) * there
                doubt = tf.reduce_sum(doubt) / n_coordinates
                total = losses[-1] + INTERMEDIATE_WEIGHT * tf.reduce_sum(losses[:-1]) + DOUBT_WEIGHT * doubt
            gradients = tape.gradient(total, network.trainable_variables)
            optimizer.apply_gradients(zip(gradients, network.trainable_variables, strict=True))
            return losses[-1], tf.reduce_sum(tf.abs(errors_um[-1])) / n_coordinates

        self.answer, self.step = answer, step

    def member(
        self,
        number: int,
        examples: Sequence[Sequence[Example]],
        tests: Sequence[Example],
        work: Path,
        earlier: Mapping[str, float],
    ) -> tuple[list[np.ndarray], Progress]:
        """Train one member, whose seed follows from the run's, or go on with it; its weights.

        `examples` are those of each training slurry, one for each of its windows of input frames; `earlier` is the cost
        of attempts before this one, as far as the members before know it.
        """
        import keras
        import tensorflow as tf

        from slurrycast.surrogates import neighbour_network

        settings, name = self.settings, f"{NAME} {number}"
        seed, epochs = derived_seed(settings["seed"], f"member {number}"), settings["epochs"]
        keras.utils.set_random_seed(seed)
        member = neighbour_network.build(**self.shape, name=f"member{number}")
        now = {
            "weights": [weights.numpy() for weights in member.trainable_variables],
            "optimizer": self.fresh,
        }
        arrays = [
            array for example in (*(one for own in examples for one in own), *tests) for array in example.arrays()
        ]
        identity = fingerprint(arrays, {**settings, "member": number})
        checkpoint, progress = work / f"checkpoint_{number}.h5", Progress(earlier=dict(earlier))
        if found := read_checkpoint(checkpoint, identity, name):
            now, progress = found
        for key, variables in self.state.items():
            for variable, value in zip(variables, now[key], strict=True):
                variable.assign(value)

        sizes = [own[0].size[0] for own in examples]
        known = shapes([one.size for own in examples for one in own])
        n_steps, start, first = epochs * len(examples), time.monotonic(), len(progress.history)
        for epoch in range(first + 1, epochs + 1):
            draw = np.random.default_rng((seed, epoch))
            losses = np.zeros((len(examples), 2))
            for place, k in enumerate(draw.permutation(len(examples))):
                drawn = examples[k][draw.integers(len(examples[k]))]
                share = ((epoch - 1) * len(examples) + place) / n_steps
                self.optimizer.learning_rate.assign(settings["learning_rate"] * learning_rate_share(share))
                shown = filled(drawn, known, settings["cutoff_um"])
                losses[k] = self.step(tf.constant(drawn.size[0]), tf.constant(shown.moved_um), *_inputs(shown.seen))
            errors_um = [(self.answer(*_inputs(test.seen))[0] - test.moved_um[-1]).numpy() for test in tests]
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
            now = {key: [variable.numpy() for variable in variables] for key, variables in self.state.items()}
            write_checkpoint(checkpoint, identity, now, progress)
        return now["weights"], progress


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
    members, epochs, learning_rate, weight_decay, layers, width, vectors, cutoff_um, earlier_frames, intermediate
    targets, input_frames, target_frame, threads, seed; the same seed gives the same result on the same machine. A
    checkpoint in `work_directory`, written after each epoch, of the same settings and data is continued as if there had
    been no break. InputError for a cutoff above half a box edge, RunError if the loss is not finite.
    """
    make_deterministic(settings["seed"], settings["threads"])
    from slurrycast.surrogates import neighbour_network

    own_windows = windows(settings["input_frames"], settings["earlier_frames"])
    examples = [[example(slurry, frames, settings) for frames in own_windows] for slurry in slurries]
    tests = [example(slurry, settings["input_frames"], settings) for slurry in validation]
    shape = {
        "n_scalars": examples[0][0].seen.scalars.shape[1],
        "n_past": examples[0][0].seen.past.shape[2],
        "shares": layer_shares(settings),
        "width": settings["width"],
        "n_vectors": settings["vectors"],
        "cutoff_um": settings["cutoff_um"],
    }
    training = _Training(shape, len(examples[0][0].moved_um), settings)
    members, histories, earlier = [], [], {"wall_s": 0.0, "cpu_s": 0.0}
    for number in range(1, settings["members"] + 1):
        member, progress = training.member(number, examples, tests, Path(work_directory), earlier)
        members.append(member)
        histories.append(progress.history)
        earlier = progress.earlier
    rows = [
        ",".join([str(epoch), *("" if np.isnan(value) else repr(float(value)) for value in row)])
        for epoch, row in enumerate(np.mean(histories, axis=0), start=1)
    ]
    write_text(history_path, "\n".join(["epoch,loss,mae,val_loss,val_mae", *rows, ""]))
    with moved_into_place(model_path) as part:
        neighbour_network.joined(shape, members).save(part)
    return earlier


def _answers(ensemble: "Ensemble", seen: Graph) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (n, members, 3) in um and logarithms of variances (n, members, 1) of all members.

    One after the other, since each needs a GB for 15000 particles, and all by one traced graph of operations, which
    takes seconds to make and, other than the layers called one by one, forgets what it needs no more.
    """
    import tensorflow as tf

    members = ensemble.flat_weights()
    answer = tf.function(
        lambda weights, *inputs: ensemble.answer(weights, list(inputs)),
        input_signature=[tf.TensorSpec(members.shape[1:]), *_signature(ensemble.network)],
        jit_compile=len(members) * len(seen.radius_um) > COMPILED_FROM,
    )
    inputs = _inputs(seen)
    answers = [[output.numpy().astype(float) for output in answer(weights, *inputs)] for weights in members]
    return tuple(np.stack(outputs, axis=1) for outputs in zip(*answers, strict=True))


def predict(inputs: PredictionInput, model_path: str | Path, settings: Mapping) -> Prediction:
    """Final unwrapped coordinates in um, in the final box of the input, and their spread (n, 3).

    Neighbours are those within the cutoff that the model was trained with, whatever `settings` say. InputError if the
    file is no model of this kind or does not fit the input.
    """
    start_keras()
    import keras

    from slurrycast.surrogates import neighbour_network

    try:
        model = keras.saving.load_model(model_path, compile=False, safe_mode=True)
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise InputError(f"{model_path}: not a readable Keras model ({str(error).splitlines()[0]})") from error
    ensembles = [layer for layer in model.layers if isinstance(layer, neighbour_network.Ensemble)]
    if len(ensembles) != 1:
        raise InputError(f"{model_path}: not a model of {NAME}, or one of an earlier version: train it again")
    (ensemble,) = ensembles
    n_scalars, n_past = ensemble.shape["n_scalars"], ensemble.shape["n_past"]
    n_frames, n_phases = len(inputs.frames), n_scalars - 2 * (n_past + 1) - 2
    if n_past != n_frames - 1:
        raise InputError(f"{model_path}: was trained on {n_past + 1} input frames, asked with {n_frames}")
    if n_phases != len(inputs.particles.phase_names):
        known = len(inputs.particles.phase_names)
        raise InputError(f"{model_path}: was trained on {n_phases} phases, slurry {inputs.slurry} has {known}")
    seen = graph(inputs.particles, inputs.frames, inputs.final_edges_um, ensemble.shape["cutoff_um"])
    moved_um, log_variance = _answers(ensemble, seen)
    # bounded, since of a neighbourhood unlike all that it learned from a network may expect anything
    length_um = np.linalg.norm(moved_um, axis=2, keepdims=True)
    moved_um = moved_um * (LARGEST_MOVE_UM / np.maximum(length_um, LARGEST_MOVE_UM))
    bounds = 2 * np.log(LEAST_SPREAD_UM), 2 * np.log(LARGEST_SPREAD_UM)
    member_um2 = np.exp(np.clip(log_variance, *bounds))
    variance_um2 = member_um2.mean(axis=1) + moved_um.var(axis=1)
    return Prediction(seen.affine_um + moved_um.mean(axis=1), spread_um=np.sqrt(variance_um2))
