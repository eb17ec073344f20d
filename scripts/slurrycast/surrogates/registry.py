"""The surrogates by name."""

import importlib
import os

from slurrycast.runtime.files import InputError
from slurrycast.surrogates.base import REGISTERED, Surrogate

# Modules of this package, each with a subclass of Surrogate of the same name. Messages list them in this order.
NAMES = (
    "direct",
    "direct_box",
    "persistence",
    "affine",
    "linear",
    "linear_box",
    "vgg16",
    "vgg16_box",
    "neighbours",
    "driven_dem",
    "early_dem",
)


def load(name: str) -> Surrogate:
    """Import the surrogate `name`. InputError if there is none with that name."""
    if name not in NAMES:
        raise InputError(f"surrogate: {name!r} is not known, allowed: {', '.join(NAMES)}")
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "2")  # TensorFlow reports its CPU features at level 1
    importlib.import_module(f"slurrycast.surrogates.{name}")
    return REGISTERED[name]
