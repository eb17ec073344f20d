"""The layers of a stored Keras model, read without Keras, so that one that does not fit is refused before any job."""

import json
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from slurrycast.runtime.files import InputError


class StoredLayer(NamedTuple):
    """A layer: its class and the arguments of its constructor."""

    kind: str
    config: dict[str, Any]


def stored_layers(path: str | Path) -> list[StoredLayer]:
    """Read the layers of a model in their order. InputError if the file is no Keras model."""
    try:
        with zipfile.ZipFile(path) as archive:
            layers = json.loads(archive.read("config.json"))["config"]["layers"]
        return [StoredLayer(layer["class_name"], dict(layer["config"])) for layer in layers]
    except (OSError, KeyError, ValueError, TypeError, IndexError, zipfile.BadZipFile) as error:
        raise InputError(f"{path} is no Keras model ({error})") from error


def input_shapes(layers: Sequence[StoredLayer]) -> dict[str, tuple[int | None, ...]]:
    """Shapes of a model's inputs by name, without the batch."""
    return {
        layer.config["name"]: tuple(layer.config["batch_shape"][1:]) for layer in layers if layer.kind == "InputLayer"
    }
