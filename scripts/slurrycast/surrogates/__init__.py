"""The surrogates: learned models that jump from early frames to the equilibrated one.

A new one is a module and a line in the registry below. A surrogate is a module with

    NAME        as in the configuration and in paths
    LOOKS_AT    what its prediction for a particle may depend on, in words for the report
    BOX_RULE    which rule gives the final box: "scale_of_prediction" (least-squares scale between predicted and last
                input coordinates) or "mean_packing_fraction" (that of the training slurries)
    fit(training_set, settings, model_path, history_path, work_directory) -> dict
                trains and writes the model and history.csv (epoch,loss,mae,val_loss,val_mae); settings hold `seed` and
                the surrogate's section of the configuration; returns earlier_wall_s and earlier_cpu_s, what attempts
                before a kill have spent; the work directory is its own, to resume from
    predict(model_path, features) -> (n, 3) float64
                unwrapped coordinates in um at the target frame, of features (n, frames, features)
"""

import importlib
import os
from pathlib import Path
from types import ModuleType

from slurrycast.files import InputError

_MODULES = {
    "vgg16": "slurrycast.surrogates.vgg16",
}
NAMES = tuple(_MODULES)


def start_keras() -> None:
    """Import Keras without TensorFlow's greeting, which its C++ part writes to stderr whatever the log level."""
    stderr = os.dup(2)
    try:
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        import keras  # noqa: F401
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)


def load(name: str) -> ModuleType:
    """Import the surrogate `name`. InputError if there is none of that name."""
    if name not in _MODULES:
        raise InputError(f"surrogate: {name!r} is not known, allowed: {', '.join(NAMES)}")
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "2")  # TensorFlow reports its CPU features at level 1
    return importlib.import_module(_MODULES[name])
