"""Keras and TensorFlow: how they are started, and how a model file is read."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

from slurrycast.runtime.files import InputError
from slurrycast.runtime.light_imports import without_matplotlib

if TYPE_CHECKING:
    import keras


def start_keras(threads: int = 1) -> None:
    """Import Keras, with a number of threads unless it is there already.

    Without TensorFlow's greeting, which its C++ part writes to stderr whatever the log level.
    """
    stderr = os.dup(2)
    try:
        with Path(os.devnull).open("wb") as nowhere, without_matplotlib():
            os.dup2(nowhere.fileno(), 2)
            import keras  # noqa: F401
            import tensorflow as tf
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)
    if not tf.config.threading.get_intra_op_parallelism_threads():
        try:
            tf.config.threading.set_intra_op_parallelism_threads(threads)
            tf.config.threading.set_inter_op_parallelism_threads(threads)
        except RuntimeError:
            print("TensorFlow is running already: its number of threads stays as it is", flush=True)


def make_deterministic(seed: int, threads: int) -> None:
    """Start TensorFlow with a number of threads, and draw everything in it from this seed."""
    start_keras(threads)
    import keras
    import tensorflow as tf

    tf.config.experimental.enable_op_determinism()
    keras.utils.set_random_seed(seed)


def read_model(path: str | Path) -> "keras.Model":
    """Read a Keras model, which may hold no code. InputError if the file is none."""
    start_keras()
    import keras

    try:
        return keras.saving.load_model(path, compile=False, safe_mode=True)
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(f"{path}: not a readable Keras model ({str(error).splitlines()[0]})") from error
