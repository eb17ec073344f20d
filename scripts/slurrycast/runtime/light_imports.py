"""Imports of libraries that would load others for features that nobody here uses."""

import contextlib
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def without_matplotlib() -> Iterator[None]:
    """Let what is imported in the block take matplotlib for not installed, unless it is loaded already.

    Keras and freud load it to draw pictures: a sixth of the start of Keras, and half of that of freud.
    """
    if "matplotlib" in sys.modules:
        yield
        return
    sys.modules["matplotlib"] = None  # what Python looks up before it searches
    try:
        yield
    finally:
        del sys.modules["matplotlib"]
