"""The network: messages between neighbours that move an estimate of the displacement.

A particle carries scalars and vectors. A message depends on scalars, distances, and the vectors of both particles along
the line between them. Vectors change by such lines and by vectors of the neighbours and of the particle, each times a
scalar. So a slurry that is shifted, turned or mirrored gets the same answer, shifted, turned or mirrored, and one whose
particles come in another order the same in that order. Every layer moves the estimate, and the next one sees distances
as they are then, as in the E(n)-equivariant networks of Satorras et al., arXiv:2102.09844; vectors as states are those
of Schütt et al., arXiv:2102.03150.

Lengths are in mean diameters of the particles, as in graph.py.
"""

from collections.abc import Callable, Mapping, Sequence

import keras
import numpy as np
import tensorflow as tf
from keras import layers

from slurrycast.surrogates.neighbours.graph import INPUTS, Graph

MOVE = 0.117  # typical move by one layer, for weights of order 1
NEIGHBOURS = 5.0  # typical number of close ones, for sums of order 1
DISTANCES = np.linspace(0.47, 1.88, 9, dtype=np.float32)  # centres and width of the basis of distances
DISTANCE_WIDTH = 0.176
# The same of gaps between surfaces, below 0 where two overlap, as asinh(gap / CONTACT): by 0.02 near contact, where
# forces begin, and by up to 0.5 at its ends, -0.35 and 0.95.
CONTACT = 0.0352
GAPS = np.linspace(-3.0, 4.0, 12, dtype=np.float32)
GAP_WIDTH = 0.6
TYPICAL_OVERLAP = 0.0587
LEFT = -2  # place among the scalars of how much the box has still to shrink
VECTOR_GAIN = 0.1  # largest share by which scalars change a vector's length in one layer
LOG_VARIANCE = -2.2  # of squared mean diameters, before training


def bounded(vectors):
    """Scale vectors (n, 3, vectors) to a root mean square length below 1; short ones hardly change.

    The output of a layer grows with them: without a bound, many layers would pass on infinity.
    """
    length2 = tf.reduce_sum(vectors**2, axis=1, keepdims=True)
    return vectors * tf.math.rsqrt(1.0 + tf.reduce_mean(length2, axis=2, keepdims=True))


@keras.saving.register_keras_serializable("slurrycast")
class Interaction(layers.Layer):
    """One exchange of messages, and the move that follows from it.

    `share` tells where the box is after the move: the share of its way to the final box, by the logarithm of the
    volume.
    """

    def __init__(self, width: int, n_vectors: int, cutoff: float, share: float, **kwargs) -> None:
        super().__init__(**kwargs)
        self.width, self.n_vectors, self.cutoff, self.share = width, n_vectors, cutoff, share
        # The first layer of a message is a sum of what receiver, sender and places contribute. Weights are stored
        # under the names of these attributes.
        self.of_receiver = layers.Dense(width)
        self.of_sender = layers.Dense(width, use_bias=False)
        self.of_places = layers.Dense(width, use_bias=False)
        self.message = layers.Dense(width, activation="silu")
        self.push = layers.Dense(2 * n_vectors, use_bias=False)  # none from no message
        self.mixed = layers.Dense(n_vectors, use_bias=False)
        self.compared = layers.Dense(n_vectors, use_bias=False)
        self.normalised = layers.LayerNormalization()
        self.inner = layers.Dense(width, activation="silu")
        self.outer = layers.Dense(width + 2 * n_vectors)
        self.move = layers.Dense(1, use_bias=False, kernel_initializer="zeros")

    def get_config(self) -> dict:
        """Arguments of the constructor."""
        shape = {"width": self.width, "n_vectors": self.n_vectors, "cutoff": self.cutoff, "share": self.share}
        return {**super().get_config(), **shape}

    def build(self, *_) -> None:
        """Make the weights."""
        n_places = len(DISTANCES) + len(GAPS) + 2 * self.n_vectors + 3
        received = 2 * self.width + 2 * self.n_vectors
        for layer, width in (
            (self.of_receiver, self.width),
            (self.of_sender, self.width),
            (self.of_places, n_places),
            (self.message, self.width),
            (self.push, self.width),
            (self.mixed, self.n_vectors),
            (self.compared, self.n_vectors),
            (self.normalised, received),
            (self.inner, received),
            (self.outer, self.width),
            (self.move, self.n_vectors),
        ):
            layer.build((None, width))

    def compute_output_spec(self, state, vectors, moved, *_, **__) -> tuple[keras.KerasTensor, ...]:
        """Return the shapes of the inputs: to trace them, as Keras would, takes most of the time to load a model."""
        return tuple(keras.KerasTensor(one.shape, one.dtype) for one in (state, vectors, moved))

    def call(self, state, vectors, moved, radius, left, receivers, senders, separation, share=None):
        """Exchange messages once, and move the estimate.

        Parameters
        ----------
        state, vectors, moved
            Scalars (n, width), vectors (n, 3, n_vectors) and estimate (n, 3) before.
        radius
            (n,).
        left
            Logarithm of the final volume of the box less that at the last input frame, (n,).
        receivers, senders, separation
            The pairs, see `build`.
        share
            Share of another layer, whose weights this one has for the call.

        Returns
        -------
        tuple
            State, vectors and estimate after the exchange.
        """
        share = self.share if share is None else share
        known = bounded(vectors)
        at_receiver, at_sender = tf.gather(known, receivers), tf.gather(known, senders)
        apart = separation + tf.gather(moved, senders) - tf.gather(moved, receivers)
        distance = tf.sqrt(tf.reduce_sum(apart**2, axis=1, keepdims=True) + 1e-6)
        direction = apart / distance
        touch = (tf.gather(radius, senders) + tf.gather(radius, receivers))[:, None]
        # places are in the final box, but two touch in the box of that time
        stretch = tf.exp((share - 1) / 3 * tf.gather(left, receivers))[:, None]
        gap = stretch * distance - touch
        places = tf.concat(
            [
                tf.exp(-(((distance - DISTANCES) / DISTANCE_WIDTH) ** 2)),
                tf.exp(-(((tf.asinh(gap / CONTACT) - GAPS) / GAP_WIDTH) ** 2)),
                tf.reduce_sum(direction[:, :, None] * at_receiver, axis=1),
                tf.reduce_sum(direction[:, :, None] * at_sender, axis=1),
                distance,
                distance - touch,  # in the final box, as the distance, by which the basis above is far too coarse
                tf.nn.relu(-gap) / TYPICAL_OVERLAP,
            ],
            axis=1,
        )
        message = tf.gather(self.of_receiver(state), receivers) + tf.gather(self.of_sender(state), senders)
        message = self.message(tf.nn.silu(message + self.of_places(places)))
        # neighbours come and go at the cutoff without a jump
        first = tf.sqrt(tf.reduce_sum(separation**2, axis=1, keepdims=True))
        message *= 0.5 * (1.0 + tf.cos(np.pi * tf.minimum(first / self.cutoff, 1.0)))
        push = self.push(message)[:, None, :]
        pushed = direction[:, :, None] * push[..., : self.n_vectors] + at_sender * push[..., self.n_vectors :]
        sums = tf.concat([message, tf.reshape(pushed, (-1, 3 * self.n_vectors))], axis=1)
        sums = tf.math.unsorted_segment_sum(sums, receivers, tf.shape(state)[0]) / NEIGHBOURS
        vectors += tf.reshape(sums[:, self.width :], (-1, 3, self.n_vectors))
        known = bounded(vectors)
        mixed = self.mixed(known)
        received = tf.concat(
            [
                state,
                sums[:, : self.width],
                tf.reduce_sum(mixed * self.compared(known), axis=1),
                tf.sqrt(tf.reduce_sum(known**2, axis=1) + 1e-6),
            ],
            axis=1,
        )
        answer = self.outer(self.inner(self.normalised(received)))
        state += answer[:, : self.width]
        stretched, turned = tf.split(answer[:, None, self.width :], 2, axis=2)
        vectors = vectors * (1.0 + VECTOR_GAIN * tf.tanh(stretched)) + mixed * turned
        return state, vectors, moved + MOVE * self.move(vectors)[:, :, 0]


def _wired(apply: Callable, exchange: Callable, inputs: Sequence) -> tuple:
    """Wire the layers of a network: displacement and logarithm of its variance.

    `apply` calls a layer by its name; `exchange` hands state, vectors and estimate (n, 3) through all interactions.
    """
    scalars, past, *_ = inputs
    start = apply("state", scalars), apply("vectors", past), keras.ops.zeros_like(past[:, :, 0])
    state, _, moved = exchange(*start)
    return moved, apply("log_variance", apply("doubt", state))


def build(
    n_scalars: int, n_past: int, shares: Sequence[float], width: int, n_vectors: int, cutoff: float, name: str
) -> keras.Model:
    """Make the network with random weights; it begins as the affine map, with no displacement at all.

    Parameters
    ----------
    n_scalars, n_past
        Numbers of scalars and of past displacements of a particle.
    shares
        One for each layer, see `Interaction`.
    width, n_vectors
        Numbers of scalars and of vectors that a particle carries.
    cutoff
        Distance at which neighbours come and go.
    name
        Name of the model.

    Returns
    -------
    keras.Model
        Inputs, of n particles and m directed pairs: scalars (n, `n_scalars`), of which that in LEFT is the logarithm of
        the final volume of the box less that at the last input frame; past (n, 3, `n_past`), radius (n,), receivers
        (m,) and senders (m,), separation (m, 3) from receiver to sender. Outputs: displacement (n, 3), and the
        logarithm of its variance per coordinate (n, 1).
    """
    shapes = {"scalars": (n_scalars,), "past": (3, n_past), "separation": (3,)}
    dtypes = dict.fromkeys(("receivers", "senders"), "int32")
    inputs = [keras.Input(shapes.get(entry, ()), dtype=dtypes.get(entry), name=entry) for entry in INPUTS]
    scalars, _, radius, *pairs = inputs
    first_guess = keras.initializers.Constant(LOG_VARIANCE)
    by_name = {
        "state": layers.Dense(width, name="state"),
        "vectors": layers.Dense(n_vectors, use_bias=False, name="vectors"),
        "doubt": layers.Dense(width, activation="silu", name="doubt"),
        "log_variance": layers.Dense(1, kernel_initializer="zeros", bias_initializer=first_guess, name="log_variance"),
    }
    constant = radius, scalars[:, LEFT], *pairs

    def exchange(*estimate):
        for number, share in enumerate(shares, start=1):
            estimate = Interaction(width, n_vectors, cutoff, share, name=f"interaction{number}")(*estimate, *constant)
        return estimate

    outputs = _wired(lambda layer, *values: by_name[layer](*values), exchange, inputs)
    return keras.Model(inputs, list(outputs), name=name)


def tensors(graph: Graph) -> list[tf.Tensor]:
    """What the network takes of a graph."""
    return [tf.constant(getattr(graph, name)) for name in INPUTS]


def signature(network: keras.Model) -> list[tf.TensorSpec]:
    """What a network takes, for any number of particles: one trace for each would make rounding depend on the order."""
    return [tf.TensorSpec((None, *entry.shape[1:]), entry.dtype) for entry in network.inputs]


def by_layer(network: keras.Model, n_stages: int) -> keras.Model:
    """Make the same network answer with the estimates after each of its last layers, (`n_stages`, n, 3)."""
    moves = [layer.output[2] for layer in network.layers if isinstance(layer, Interaction)]
    return keras.Model(network.inputs, [keras.ops.stack(moves[-n_stages:]), network.outputs[1]])


@keras.saving.register_keras_serializable("slurrycast")
class Ensemble(layers.Layer):
    """Networks of one shape: that of the first member, and the weights of the others.

    `shape` holds the arguments of `build` but for the name. There is one network for all members because it takes a
    second to make one.
    """

    def __init__(self, shape: Mapping, n_members: int, **kwargs) -> None:
        super().__init__(**kwargs)
        self.shape, self.n_members = dict(shape), n_members
        self.network = build(**shape, name="member")
        n_weights = sum(self._sizes())
        self.others = self.add_weight((n_members - 1, n_weights), "zeros", name="others")

    def get_config(self) -> dict:
        """Arguments of the constructor."""
        return {**super().get_config(), "shape": self.shape, "n_members": self.n_members}

    def _sizes(self) -> list[int]:
        return [int(np.prod(variable.shape)) for variable in self.network.trainable_variables]

    def take(self, members: Sequence[Sequence[np.ndarray]]) -> None:
        """Take the weights of all members, each in the order of a network."""
        first, *others = members
        for variable, value in zip(self.network.trainable_variables, first, strict=True):
            variable.assign(value)
        flat = [np.concatenate([np.ravel(value) for value in member]) for member in others]
        self.others.assign(np.reshape(flat, self.others.shape))

    def member_weights(self) -> list[list[np.ndarray]]:
        """Weights of all members, as `take` takes them."""
        shapes = [variable.shape for variable in self.network.trainable_variables]
        ends = np.cumsum(self._sizes())[:-1]
        return [
            [np.reshape(value, shape) for value, shape in zip(np.split(member, ends), shapes, strict=True)]
            for member in self.flat_weights().numpy()
        ]

    def flat_weights(self) -> tf.Tensor:
        """Weights of all members, (members, weights)."""
        first = tf.concat([tf.reshape(variable, [-1]) for variable in self.network.trainable_variables], axis=0)
        return tf.concat([first[None], self.others], axis=0)

    def answer(self, weights, inputs):
        """Answer of the member with these `weights`, a row of `flat_weights`; see `build`.

        All layers are one program in a loop: a program of one layer after the other takes seconds to trace and to
        compile.
        """
        scalars, _, radius, *pairs = inputs
        parts = iter(tf.split(weights, self._sizes()))
        layer_weights = {
            layer.name: [tf.reshape(next(parts), variable.shape) for variable in layer.trainable_variables]
            for layer in self.network.layers
        }

        def apply(name, *values):
            return self.network.get_layer(name).stateless_call(layer_weights[name], [], *values)[0]

        shares = tf.constant(self.shape["shares"])
        names = [layer.name for layer in self.network.layers if isinstance(layer, Interaction)]
        one = self.network.get_layer(names[0])
        stacked = [tf.stack(values) for values in zip(*(layer_weights[name] for name in names), strict=True)]

        def step(k, *estimate):
            values = [tf.gather(value, k) for value in stacked]
            arguments = (*estimate, radius, scalars[:, LEFT], *pairs, shares[k])
            return k + 1, *one.stateless_call(values, [], *arguments)[0]

        def exchange(*estimate):
            return tf.while_loop(lambda k, *_: k < len(names), step, (0, *estimate))[1:]

        return _wired(apply, exchange, inputs)

    def compute_output_spec(self, inputs, **_) -> tuple[keras.KerasTensor, ...]:
        """Return the shapes of the answers: to trace them, as Keras would, takes a second."""
        n = inputs[0].shape[0]
        return tuple(keras.KerasTensor((n, self.n_members, last), self.compute_dtype) for last in (3, 1))

    def call(self, inputs):
        """Displacements (n, members, 3) and logarithms of variances (n, members, 1)."""
        answers = [self.answer(weights, inputs) for weights in tf.unstack(self.flat_weights())]
        return tuple(tf.stack(outputs, axis=1) for outputs in zip(*answers, strict=True))


def joined(shape: Mapping, members: Sequence[Sequence[np.ndarray]]) -> keras.Model:
    """Join members of one shape to one model, from the weights of each in the order of a network."""
    ensemble = Ensemble(shape, len(members), name="ensemble")
    ensemble.take(members)
    inputs = [keras.Input(i.shape[1:], dtype=i.dtype, name=i.name) for i in ensemble.network.inputs]
    return keras.Model(inputs, list(ensemble(inputs)), name="neighbours")
