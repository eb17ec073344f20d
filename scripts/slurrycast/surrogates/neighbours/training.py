"""Training of the members: one network, its optimizer and a compiled step, in which they learn one after the other."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from slurrycast.data.trajectories import Trajectory
from slurrycast.dem.recipe import derived_seed
from slurrycast.runtime.files import InputError, moved_into_place
from slurrycast.surrogates.backend import make_deterministic, read_model
from slurrycast.surrogates.checkpoint import Progress, assign, fingerprint, run_epochs, write_history
from slurrycast.surrogates.neighbours.graph import PAIR_INPUTS, Graph
from slurrycast.surrogates.neighbours.targets import Example, layer_shares, make_example, windows

WARM_UP = 0.15  # share of the steps over which the learning rate rises; then it falls as a cosine
GRADIENT_NORM = 1.4
INTERMEDIATE_WEIGHT = 0.3  # of the squared error at each of them, beside that at the end
DOUBT_WEIGHT = 0.0138  # of the likelihood of the variance, which has another head, beside the squared error
SHAPE_RATIO = 1.5  # of sizes for which a step is compiled: a compilation takes as long as some 20 steps
# Weights learn by Muon, which makes every direction of a step equally long and needs fewer steps than Adam; but the
# layers that take the inputs in or give the variance, and biases and norms, learn by Adam at this share of the rate.
LEARN_BY_ADAM = ("state", "vectors", "doubt", "log_variance")
ADAM_SHARE = 0.3


def shapes(sizes: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Choose a few shapes (particles, pairs), so that each of the `sizes` fits into one; from small to large.

    They are the largest size and this divided by powers of `SHAPE_RATIO`, as far as any slurry needs them.
    """
    largest, smallest = np.max(sizes, axis=0), np.min(sizes, axis=0)
    n_shapes = 1 + int(np.log((largest / smallest).min()) / np.log(SHAPE_RATIO))
    ratios = SHAPE_RATIO ** -np.arange(n_shapes)[::-1, None]
    known = [tuple(int(n) for n in shape) for shape in np.ceil(largest * ratios)]
    return [shape for shape in known if any(_fitting(size, known) == shape for size in sizes)]


def _fitting(size: tuple[int, int], known: Sequence[tuple[int, int]]) -> tuple[int, int]:
    return next(shape for shape in known if size[0] <= shape[0] and size[1] <= shape[1])


def filled(example: Example, known: Sequence[tuple[int, int]], cutoff: float) -> Example:
    """Add particles and pairs up to the first of the `known` shapes that the example fits in.

    The pairs that are added join the last particle to itself, from so far that it hears nothing. Particles
    that are added have no other pairs.
    """
    n, m = (to - size for to, size in zip(_fitting(example.size, known), example.size, strict=True))
    last = example.size[0] + n - 1
    graph = {
        name: np.pad(value, [(0, m if name in PAIR_INPUTS else n), *[(0, 0)] * (value.ndim - 1)])
        for name, value in vars(example.graph).items()
    }
    for name, value in zip(PAIR_INPUTS, (last, last, 2 * cutoff), strict=True):
        graph[name][example.size[1] :] = value
    return replace(example, graph=Graph(**graph), moved=np.pad(example.moved, [(0, 0), (0, n), (0, 0)]))


class Learner:
    """One network, its optimizer and a compiled step, in which all members learn, one after the other."""

    def __init__(self, shape: Mapping, n_stages: int, settings: Mapping) -> None:
        import keras
        import tensorflow as tf

        from slurrycast.surrogates.neighbours.network import build, by_layer, signature

        self.shape, self.settings = shape, settings
        self.network = network = build(**shape, name="learner")
        self.optimizer = optimizer = keras.optimizers.Muon(
            settings["learning_rate"],
            adam_lr_ratio=ADAM_SHARE,
            weight_decay=settings["weight_decay"],
            adam_weight_decay=settings["weight_decay"],
            exclude_layers=[f"(^|/){name}(/|$)" for name in LEARN_BY_ADAM],
            clipnorm=GRADIENT_NORM,
        )
        optimizer.build(network.trainable_variables)
        self.variables = {"weights": network.trainable_variables, "optimizer": optimizer.variables}
        self.fresh = [variable.numpy() for variable in optimizer.variables]
        inputs = signature(network)
        staged = by_layer(network, n_stages)

        @tf.function(input_signature=inputs)
        def answer(*inputs):
            return network(list(inputs), training=False)

        # as one program of machine code a step takes half as long as operation by operation
        @tf.function(
            input_signature=[tf.TensorSpec((), "int32"), tf.TensorSpec((n_stages, None, 3)), *inputs],
            jit_compile=True,
        )
        def step(n_particles, targets, *inputs):
            there = tf.cast(tf.range(tf.shape(targets)[1]) < n_particles, tf.float32)[:, None]
            n_coordinates = 3.0 * tf.cast(n_particles, tf.float32)
            with tf.GradientTape() as tape:
                moved, log_variance = staged(list(inputs), training=True)
                errors = (moved - targets) * there
                losses = tf.reduce_sum(errors**2, axis=(1, 2)) / n_coordinates
                error = tf.stop_gradient(errors[-1])
                doubt = (log_variance + error**2 * tf.exp(-log_variance)) * there
                doubt = tf.reduce_sum(doubt) / n_coordinates
                total = losses[-1] + INTERMEDIATE_WEIGHT * tf.reduce_sum(losses[:-1]) + DOUBT_WEIGHT * doubt
            gradients = tape.gradient(total, network.trainable_variables)
            optimizer.apply_gradients(zip(gradients, network.trainable_variables, strict=True))
            return losses[-1], tf.reduce_sum(tf.abs(errors[-1])) / n_coordinates

        self.answer, self.step = answer, step

    def learn(self, example: Example, known: Sequence[tuple[int, int]]) -> np.ndarray:
        """Take a step on an example, filled up to one of the `known` shapes: squared (um2) and absolute error (um)."""
        import tensorflow as tf

        from slurrycast.surrogates.neighbours.network import tensors

        shown = filled(example, known, self.settings["cutoff_diameters"])
        errors = self.step(tf.constant(example.size[0]), tf.constant(shown.moved), *tensors(shown.graph))
        return np.array(errors) * (example.diameter_um**2, example.diameter_um)

    def test(self, tests: Sequence[Example]) -> np.ndarray:
        """Mean squared (um2) and absolute error (um); slurries count alike, so that the largest does not decide."""
        from slurrycast.surrogates.neighbours.network import tensors

        errors_um = [
            (self.answer(*tensors(test.graph))[0] - test.moved[-1]).numpy() * test.diameter_um for test in tests
        ]
        errors = [[np.mean(error_um**2), np.mean(abs(error_um))] for error_um in errors_um]
        return np.mean(errors or [[np.nan, np.nan]], axis=0)

    def member(
        self,
        number: int,
        examples: Sequence[Sequence[Example]],
        tests: Sequence[Example],
        folder: Path,
        earlier: Mapping[str, float],
        start: Sequence[np.ndarray] | None = None,
    ) -> tuple[list[np.ndarray], Progress]:
        """Train one member, whose seed follows from that of the run, or continue its training.

        Parameters
        ----------
        number
            Number of the member, from 1.
        examples
            Those of each training slurry, one for each of its windows of input frames.
        tests
            One example of each validation slurry.
        folder
            Keeps the checkpoints.
        earlier
            Cost of attempts before this one, as far as the members before know it.
        start
            Weights that it starts with; random ones without.

        Returns
        -------
        tuple
            Weights and progress.
        """
        import keras

        from slurrycast.surrogates.neighbours.network import build

        settings = self.settings
        seed = derived_seed(settings["seed"], f"member {number}")
        keras.utils.set_random_seed(seed)
        member = build(**self.shape, name=f"member{number}")
        weights = start or [variable.numpy() for variable in member.trainable_variables]
        assign(self.variables, {"weights": weights, "optimizer": self.fresh})
        arrays = [array for example in (*itertools.chain(*examples), *tests) for array in example.arrays()]
        sizes = [choices[0].size[0] for choices in examples]
        known = shapes([example.size for example in itertools.chain(*examples)])

        def train_epoch(epoch: int) -> np.ndarray:
            draw = np.random.default_rng((seed, epoch))
            losses = np.zeros((len(examples), 2))
            for place, k in enumerate(draw.permutation(len(examples))):
                drawn = examples[k][draw.integers(len(examples[k]))]
                share = ((epoch - 1) * len(examples) + place) / (settings["epochs"] * len(examples))
                self.optimizer.learning_rate.assign(settings["learning_rate"] * learning_rate_share(share))
                losses[k] = self.learn(drawn, known)
            return np.array([*np.average(losses, axis=0, weights=sizes), *self.test(tests)])

        progress = run_epochs(
            f"neighbours {number}",
            settings,
            folder / f"checkpoint_{number}.h5",
            fingerprint(arrays, {**settings, "member": number}),
            self.variables,
            train_epoch,
            earlier=earlier,
            validated=bool(tests),
        )
        return [variable.numpy() for variable in self.network.trainable_variables], progress


def learning_rate_share(share: float) -> float:
    """Learning rate as a share of its highest, after `share` of the steps: up in a line, down as a cosine."""
    if share < WARM_UP:
        return share / WARM_UP
    return 0.5 * (1 + np.cos(np.pi * (share - WARM_UP) / (1 - WARM_UP)))


def network_shape(settings: Mapping, n_frames: int, n_phases: int) -> dict:
    """Arguments of `network.build` but for the name; a node knows its phase, as one number for each, see graph.py."""
    return {
        "n_scalars": n_phases + 2 * n_frames + 2,
        "n_past": n_frames - 1,
        "shares": layer_shares(settings),
        "width": settings["width"],
        "n_vectors": settings["vectors"],
        "cutoff": settings["cutoff_diameters"],
    }


def misfit(stored: Mapping, n_stored: int, shape: Mapping, settings: Mapping) -> str | None:
    """What of a stored ensemble of `n_stored` members keeps networks of `shape` from going on with it."""
    if n_stored != settings["members"]:
        return f"has {n_stored} members, needed are {settings['members']}: each goes on from its own"
    if stored["n_past"] != shape["n_past"]:
        return f"was trained on {stored['n_past'] + 1} input frames, needed are {shape['n_past'] + 1}"
    names = {"n_scalars": "number of features", "shares": "layers and intermediate targets", "n_vectors": "vectors"}
    for key, value in shape.items():
        if stored[key] != value:
            return f"has {names.get(key, key)} {stored[key]}, needed is {value}"
    return None


def stored_members(path: str, shape: Mapping, settings: Mapping) -> list[list[np.ndarray]]:
    """Weights of the members of a stored model that a training goes on with. InputError if it does not fit."""
    from slurrycast.surrogates.neighbours.network import Ensemble

    ensembles = [layer for layer in read_model(path).layers if isinstance(layer, Ensemble)]
    if len(ensembles) != 1:
        raise InputError(f"{path}: is no model of neighbours")
    if problem := misfit(ensembles[0].shape, ensembles[0].n_members, shape, settings):
        raise InputError(f"{path}: {problem}")
    return ensembles[0].member_weights()


def train(
    slurries: Sequence[Trajectory], validation: Sequence[Trajectory], settings: Mapping, folder: Path
) -> dict[str, float]:
    """Train the members and write them as one model; the learning curves are the mean over the members.

    A step takes one slurry: the mean squared error of its displacement, in mean diameters and float32. The expected
    variance learns beside it, by its likelihood. The weights are of the last epoch, at which the learning rate has come
    to nothing: the validation slurries are looked at, not chosen by. A checkpoint is written after each epoch; one of
    the same settings and data is continued as if there had been no break. The same seed gives the same result on the
    same machine.

    Parameters
    ----------
    slurries, validation
        Training slurries and validation slurries; without the latter, columns of the learning curves are empty.
    settings
        members, epochs, learning_rate, weight_decay, layers, width, vectors, cutoff_diameters, earlier_frames,
        intermediate_targets, input_frames, target_frame, threads, seed; start_from, the path of a model whose members
        go on, each from its own weights, if any.
    folder
        See `Surrogate.train`.

    Returns
    -------
    dict
        wall_s and cpu_s of attempts before this one.

    Raises
    ------
    InputError
        If the cutoff is above half a box edge, or the stored model does not fit.
    RunError
        If the loss is not finite.
    """
    make_deterministic(settings["seed"], settings["threads"])
    from slurrycast.surrogates.neighbours.network import joined

    input_windows = windows(settings["input_frames"], settings["earlier_frames"])
    examples = [[make_example(slurry, frames, settings) for frames in input_windows] for slurry in slurries]
    tests = [make_example(slurry, settings["input_frames"], settings) for slurry in validation]
    shape = network_shape(settings, len(settings["input_frames"]), len(slurries[0].particles.phase_names))
    starts = stored_members(path, shape, settings) if (path := settings.get("start_from")) else None
    learner = Learner(shape, len(examples[0][0].moved), settings)
    members, histories, earlier = [], [], {"wall_s": 0.0, "cpu_s": 0.0}
    for number in range(1, settings["members"] + 1):
        start = starts[number - 1] if starts else None
        member, progress = learner.member(number, examples, tests, folder, earlier, start)
        members.append(member)
        histories.append(progress.history)
        earlier = progress.earlier
    write_history(folder / "history.csv", np.mean(histories, axis=0))
    with moved_into_place(folder / "model.keras") as part:
        joined(shape, members).save(part)
    return earlier
