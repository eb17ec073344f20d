"""The published surrogate: VGG16 made one-dimensional, from a particle's input frames to its final coordinates.

Layers as in Table 2, training as in the text of Le-Dinh et al., J. Power Sources 2026,
doi 10.1016/j.jpowsour.2026.240447; the hidden activation (not stated there) is ReLU as in Simonyan & Zisserman,
arXiv:1409.1556.

Training computes the same with less work, and writes the plain network. Pooling shortens the four frames to length 1
behind block 2; there the outer taps of a "same" convolution of kernel 3 only ever see padding: their gradient is
exactly 0, Adamax never moves them, and the layer is a dense one with the centre tap. The 4096 units of the wide dense
layers are computed and updated in shards, whose arrays make better use of the cache.
"""

import itertools
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slurrycast.data.dataset import TrainingSet
from slurrycast.data.features import COORDINATES, FEATURE_NAMES, particle_history
from slurrycast.runtime.files import InputError, moved_into_place
from slurrycast.surrogates.backend import make_deterministic, read_model
from slurrycast.surrogates.base import SCALE_OF_PREDICTION, Surrogate
from slurrycast.surrogates.checkpoint import fingerprint, run_epochs, without_epochs, write_history
from slurrycast.surrogates.prediction import Prediction, PredictionInput
from slurrycast.surrogates.samples import Samples, Standardisation
from slurrycast.surrogates.stored_model import StoredLayer, input_shapes, stored_layers

if TYPE_CHECKING:
    import keras
    import tensorflow as tf

RELATIVE_EDGE_UM = 10.0  # edge to which boxes are scaled for vgg16_relative: numbers stay about as large as in um

BLOCKS = ((64, 64), (128, 128), (256, 256, 256), (512, 512, 512), (512, 512, 512))  # filters of the convolutions
DENSE_UNITS = 4096
# The reference article does not state the initial weights. He et al., arXiv:1502.01852, made these for deep networks of
# ReLU; with Keras' default (Glorot & Bengio 2010) the signal all but vanishes on its way through 13 convolutions.
INITIALIZER = "he_uniform"
KERNEL = 3

# Adamax as in Kingma & Ba, arXiv:1412.6980, with the defaults of Keras.
BETA_1, BETA_2, EPSILON = 0.9, 0.999, 1e-7

SHARD_UNITS = 512  # fastest of 128 to 4096 at batches of 100, where it saves 16 % of a step; no effect at 500
PREDICTION_BATCH = 1024


def build(n_frames: int, n_features: int, standardisation: Standardisation | None = None) -> "keras.Model":
    """Make the network of Table 2 with random weights: (batch, n_frames, n_features) to (batch, 3).

    A `standardisation` becomes two layers without weights, before and behind the others.
    """
    from keras import Input, Model, layers

    x = inputs = Input((n_frames, n_features), name="frames")
    if standardisation is not None:
        mean, deviation = standardisation.feature_mean, standardisation.feature_deviation
        x = layers.Normalization(mean=mean.tolist(), variance=(deviation**2).tolist(), name="standardised")(x)
    for block, filters in enumerate(BLOCKS, start=1):
        for number, n_filters in enumerate(filters, start=1):
            name = f"block{block}_conv{number}"
            x = layers.Conv1D(
                n_filters, KERNEL, padding="same", activation="relu", kernel_initializer=INITIALIZER, name=name
            )(x)
        x = layers.MaxPooling1D(2, padding="same", name=f"block{block}_pool")(x)
    x = layers.Flatten(name="flatten")(x)
    x = layers.Dense(DENSE_UNITS, activation="relu", kernel_initializer=INITIALIZER, name="dense1")(x)
    x = layers.Dense(DENSE_UNITS, activation="relu", kernel_initializer=INITIALIZER, name="dense2")(x)
    x = layers.Dense(3, name="coordinates_um" if standardisation is None else "standardised_target")(x)
    if standardisation is not None:
        x = layers.Rescaling(standardisation.target_deviation, name="target")(x)
    return Model(inputs, x, name="vgg16")


def misfit(layers: Sequence[StoredLayer], shape: Sequence[int], standardised: bool) -> str | None:
    """What of the layers of a stored model is not as `build` makes them for inputs (frames, features)."""
    (has, *others) = input_shapes(layers).values() or [None]
    if others or has != tuple(shape):
        return f"takes inputs of shape {has}, needed is {tuple(shape)}"
    units = [layer.config.get("filters", layer.config.get("units")) for layer in layers]
    if [n for n in units if n is not None] != [*itertools.chain(*BLOCKS), DENSE_UNITS, DENSE_UNITS, 3]:
        return "has other layers than the published network"
    if any(layer.kind == "Normalization" for layer in layers) != standardised:
        return f"does {'not standardise' if standardised else 'standardise'} its inputs"
    return None


def started(path: str, standardised: bool, shape: Sequence[int]) -> "keras.Model":
    """Read the model that a training goes on with. InputError if it does not fit."""
    if problem := misfit(stored_layers(path), shape, standardised):
        raise InputError(f"{path}: {problem}")
    return read_model(path)


def standardisation_of(model: "keras.Model") -> Standardisation:
    """The standardisation that is in a model."""
    inputs, target = model.get_layer("standardised").get_config(), model.get_layer("target").get_config()
    return Standardisation(np.array(inputs["mean"]), np.sqrt(inputs["variance"]), float(target["scale"]))


def trained_parts(plain: "keras.Model", weights: list[np.ndarray]) -> list[list[tuple[np.ndarray, np.ndarray]]]:
    """Return views of what training moves in `weights` of `plain`: the shards (kernel, bias) of each layer.

    Where the length is 1 the kernel is the centre tap, (channels, filters). Wide layers come in shards of SHARD_UNITS.
    """
    parts = []
    layers = [layer for layer in plain.layers if layer.weights]
    for layer, kernel, bias in zip(layers, weights[::2], weights[1::2], strict=True):
        if kernel.ndim == 3 and layer.input.shape[1] == 1:
            kernel = kernel[KERNEL // 2]
        shards = max(1, kernel.shape[-1] // SHARD_UNITS) if kernel.ndim == 2 else 1
        parts.append(list(zip(np.split(kernel, shards, axis=-1), np.split(bias, shards), strict=True)))
    return parts


def in_batches(answer: Callable[[np.ndarray], "tf.Tensor"], features: np.ndarray) -> np.ndarray:
    """Answers of a network to all features, PREDICTION_BATCH of them at a time."""
    starts = range(0, len(features), PREDICTION_BATCH)
    return np.concatenate([answer(features[start : start + PREDICTION_BATCH]) for start in starts])


class Trainer:
    """The trained parts of a network with their Adamax state; mean squared error on mini-batches.

    TensorFlow's fused update reads and writes each array once or twice, where Keras' own Adamax makes a dozen
    temporaries of the size of the weights; the formula is the same.
    """

    def __init__(self, plain: "keras.Model", learning_rate: float) -> None:
        import tensorflow as tf

        self.layers = [
            [(tf.Variable(kernel), tf.Variable(bias)) for kernel, bias in shards]
            for shards in trained_parts(plain, plain.get_weights())
        ]
        self.weights = [weight for shards in self.layers for shard in shards for weight in shard]
        momentum, norm = ([tf.Variable(tf.zeros_like(weight)) for weight in self.weights] for _ in range(2))
        steps = tf.Variable(0, dtype=tf.int64)
        self.variables = {"weights": self.weights, "momentum": momentum, "norm": norm, "steps": [steps]}

        features = tf.TensorSpec((None, *plain.input_shape[1:]))
        targets = tf.TensorSpec((None, 3))
        unit_um = tf.TensorSpec((None, None))

        @tf.function(input_signature=[features])
        def predict_on_batch(features):
            return self._forward(features)

        @tf.function(input_signature=[features, targets, unit_um])
        def train_on_batch(features, targets, unit_um):
            with tf.GradientTape() as tape:
                error = (self._forward(features) - targets) * unit_um
                loss = tf.reduce_mean(tf.square(error))
            gradients = tape.gradient(loss, self.weights)
            steps.assign_add(1)
            beta_1_power = tf.pow(BETA_1, tf.cast(steps, tf.float32))
            for weight, m, u, gradient in zip(self.weights, momentum, norm, gradients, strict=True):
                tf.raw_ops.ResourceApplyAdaMax(
                    var=weight.handle,
                    m=m.handle,
                    v=u.handle,
                    beta1_power=beta_1_power,
                    lr=learning_rate,
                    beta1=BETA_1,
                    beta2=BETA_2,
                    epsilon=EPSILON,
                    grad=gradient,
                )
            return loss, tf.reduce_mean(tf.abs(error))

        self.predict_on_batch = predict_on_batch
        self.train_on_batch = train_on_batch

    def _forward(self, x: "tf.Tensor") -> "tf.Tensor":
        """Apply the network: the same as `build` says, on the trained parts."""
        import tensorflow as tf

        def apply(shards):
            if shards[0][0].shape.rank == 3:
                ((kernel, bias),) = shards
                return tf.nn.bias_add(tf.nn.conv1d(x, kernel, 1, "SAME"), bias)
            flat = tf.reshape(x, (-1, shards[0][0].shape[0]))
            return tf.concat([tf.nn.bias_add(tf.matmul(flat, kernel), bias) for kernel, bias in shards], axis=1)

        layers = iter(self.layers)
        for filters in BLOCKS:
            for _ in filters:
                x = tf.nn.relu(apply(next(layers)))
            if x.shape.rank == 3:
                x = tf.nn.max_pool1d(x, 2, 2, "SAME")
        for _ in ("dense1", "dense2"):
            x = tf.nn.relu(apply(next(layers)))
        return apply(next(layers))

    def write_back(self, plain: "keras.Model", trained: list[np.ndarray]) -> None:
        """Give `plain` the weights `trained`, in the order of `weights`; its outer taps stay as they are."""
        weights = plain.get_weights()
        parts = [part for shards in trained_parts(plain, weights) for shard in shards for part in shard]
        for part, new in zip(parts, trained, strict=True):
            part[...] = new
        plain.set_weights(weights)

    def train_epoch(
        self, features: np.ndarray, targets: np.ndarray, unit_um: np.ndarray, order: np.ndarray, size: int
    ) -> np.ndarray:
        """Run one pass in batches of `size` in `order`; return mean squared and mean absolute error of the pass."""
        batches = [order[start : start + size] for start in range(0, len(order), size)]
        errors = [np.stack(self.train_on_batch(features[at], targets[at], unit_um[at])) for at in batches]
        return np.average(errors, axis=0, weights=[len(batch) for batch in batches])

    def errors(self, features: np.ndarray, targets: np.ndarray, unit_um: np.ndarray) -> np.ndarray:
        """Mean squared and mean absolute error."""
        error_um = self.errors_um(features, targets, unit_um)
        return np.array([np.mean(error_um**2), np.mean(abs(error_um))])

    def errors_um(self, features: np.ndarray, targets: np.ndarray, unit_um: np.ndarray) -> np.ndarray:
        """Error (n, 3) of each sample in um."""
        return (in_batches(self.predict_on_batch, features) - targets) * unit_um


def in_units(features: np.ndarray, unit_um: np.ndarray) -> np.ndarray:
    """Features (n, frames, 6) with their coordinates divided by `unit_um` (n, 3) or (1, 3)."""
    scaled = features.copy()
    scaled[..., COORDINATES] /= unit_um[:, None]
    return scaled


def is_looked_at(epoch: int) -> bool:
    """Whether errors of held-out slurries are measured after this epoch: powers of 2, and every 50th."""
    return epoch & (epoch - 1) == 0 or epoch % 50 == 0


def mean_errors(error_um: np.ndarray, slurry_index: np.ndarray) -> np.ndarray:
    """Mean squared and mean absolute error: means over slurries, each less its common shift, as tables have them."""
    by_slurry = [error_um[slurry_index == k] for k in np.unique(slurry_index)]
    by_slurry = [error_um - error_um.mean(axis=0) for error_um in by_slurry]
    return np.mean([[np.mean(error_um**2), np.mean(abs(error_um))] for error_um in by_slurry], axis=0)


def train(
    name: str,
    samples: Samples,
    standardised: bool,
    settings: Mapping,
    folder: Path,
    held_out: Mapping[str, tuple[Samples, np.ndarray]] | None = None,
) -> dict[str, float]:
    """Train with Adamax on the mean squared error, and write the plain Keras model and its learning curves.

    The model has the weights of the epoch with the lowest validation loss. A checkpoint is written after each epoch;
    one of the same data and settings, or of fewer epochs, is continued as if there had been no break. The same seed
    gives the same result on the same machine.

    Parameters
    ----------
    name
        Name of the surrogate, for messages.
    samples
        Training and validation samples.
    standardised
        Whether the network sees samples by the mean and deviation of the training part. The model that is written does
        this by itself.
    settings
        epochs, batch_size, learning_rate, threads, seed; patience and min_improvement (`checkpoint.has_settled`);
        start_from, the path of a model to go on with, if any.
    folder
        See `Surrogate.train`.
    held_out
        Samples of held-out slurries and the number of each sample's slurry, by the name of the set.

    Returns
    -------
    dict
        wall_s and cpu_s of attempts before this one.

    Raises
    ------
    InputError
        If a setting is missing, or the stored model does not fit.
    RunError
        If the loss is not finite.
    """
    for key in ("epochs", "batch_size", "learning_rate", "threads"):
        if not settings.get(key, 0) > 0:
            raise InputError(f"{name}: setting {key} is {settings.get(key)}, it must be above 0")
    make_deterministic(settings["seed"], settings["threads"])
    standardisation = Standardisation.fitted(samples) if standardised else None
    if path := settings.get("start_from"):
        plain = started(path, standardised, samples.features.shape[1:])
        standardisation = standardisation_of(plain) if standardised else None
    else:
        plain = build(*samples.features.shape[1:], standardisation)
    trainer = Trainer(plain, settings["learning_rate"])
    held_out = held_out or {}
    known = [samples, *(of_set for of_set, _ in held_out.values())]
    identity = fingerprint((array for some in known for array in vars(some).values()), without_epochs(settings))
    samples, *others = [some if standardisation is None else standardisation.apply(some) for some in known]
    arrays, *other_arrays = [
        [array.astype(np.float32) for array in (some.features, some.targets, some.unit_um)]
        for some in (samples, *others)
    ]
    held = samples.is_validation
    trained = np.flatnonzero(~held)

    def train_epoch(epoch: int) -> np.ndarray:
        order = np.random.default_rng((settings["seed"], epoch)).permutation(trained)
        losses = trainer.train_epoch(*arrays, order, settings["batch_size"])
        found = [losses, trainer.errors(*(array[held] for array in arrays))]
        for its_arrays, (_, slurry_index) in zip(other_arrays, held_out.values(), strict=True):
            looked = is_looked_at(epoch)
            found.append(mean_errors(trainer.errors_um(*its_arrays), slurry_index) if looked else [np.nan] * 2)
        return np.concatenate(found)

    checkpoint = folder / "checkpoint.h5"
    progress = run_epochs(name, settings, checkpoint, identity, trainer.variables, train_epoch, keep_best=True)
    validation = [row[2] for row in progress.history]
    print(f"[{name}] best epoch {1 + int(np.argmin(validation))}, val_loss {min(validation):.4g}", flush=True)
    trainer.write_back(plain, progress.best)
    write_history(folder / "history.csv", progress.history, held_out)
    with moved_into_place(folder / "model.keras") as part:
        plain.save(part)
    return progress.earlier


def apply_model(model_path: str | Path, features: np.ndarray) -> np.ndarray:
    """Answer (n, 3) of a network to features (n, frames, features), float64.

    Any Keras model with these shapes will do. It computes in float32: coordinates of 100 um keep 1e-5 um. InputError
    if the file is no Keras model or does not fit the features.
    """
    model = read_model(model_path)
    if model.input_shape[1:] != features.shape[1:] or model.output_shape[1:] != (3,):
        raise InputError(
            f"{model_path}: maps {model.input_shape[1:]} to {model.output_shape[1:]}, "
            f"needed is {features.shape[1:]} to (3,)"
        )
    return in_batches(lambda batch: model(batch, training=False), features.astype(np.float32)).astype(float)


class Vgg16(Surrogate):
    """The published network, on coordinates in um, and two variants.

    `vgg16_relative` sees and gives coordinates in shares of the last input box: it tells whether it matters that those
    of a large box lie outside what the network was trained on. `vgg16_standardised` sees features less their mean and
    over their deviation in the training samples; the article does not say whether it does. Its targets are divided by
    their root mean square, one number for all axes: nothing is subtracted, since coordinates are about the box centre.
    Without this the last layer alone would have to make lengths of 10 um out of numbers about 1.
    """

    name = "vgg16"
    looks_at = "phase, radius, unwrapped coordinates and coordination of the particle itself in the input frames"
    box_rule = SCALE_OF_PREDICTION
    model_file = "model.keras"
    weights_epoch = "lowest"
    goes_on = True
    learns_from = "samples"
    variant = re.compile("(?P<change>relative|standardised)?")

    def input_shapes(self, n_frames: int, settings: Mapping) -> dict[str, tuple[int, ...]]:
        """Shape of what the network takes of a particle: frames, features."""
        return {"features": (n_frames, len(FEATURE_NAMES))}

    def misfit(self, layers: Sequence[StoredLayer], n_frames: int, n_phases: int, settings: Mapping) -> str | None:
        """What of the layers of a stored model does not fit; see `misfit`."""
        return misfit(
            layers, self.input_shapes(n_frames, settings)["features"], settings.get("change") == "standardised"
        )

    def train(
        self, data: TrainingSet, settings: Mapping, folder: Path, held_out: Mapping[str, TrainingSet] | None = None
    ) -> dict[str, float]:
        """Train on unwrapped coordinates; see `train`."""

        def samples(data: TrainingSet) -> Samples:
            unit_um = _unit_um(data.input_edges_um[data.slurry_index, -1], settings)
            return Samples(in_units(data.features, unit_um), data.targets / unit_um, unit_um, data.is_validation)

        change = settings.get("change")
        name = f"{self.name}_{change}" if change else self.name
        others = {name: (samples(other), other.slurry_index) for name, other in (held_out or {}).items()}
        return train(name, samples(data), change == "standardised", settings, folder, others)

    def predict(self, inputs: PredictionInput, model_path: str | Path, settings: Mapping) -> Prediction:
        """Predict final unwrapped coordinates in um; see `apply_model`."""
        unit_um = _unit_um(inputs.last.edges_um[None], settings)
        features = in_units(particle_history(inputs.particles, inputs.frames), unit_um)
        return Prediction(apply_model(model_path, features) * unit_um)


def _unit_um(edges_um: np.ndarray, settings: Mapping) -> np.ndarray:
    """Length in um of a coordinate of 1, for edges (n, 3) of the box at the last input frame."""
    return edges_um / RELATIVE_EDGE_UM if settings.get("change") == "relative" else np.ones_like(edges_um)
