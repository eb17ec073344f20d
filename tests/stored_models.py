"""Files as Keras stores models, with layers alone, for checks that read no weights."""

import json
import zipfile
from collections.abc import Sequence
from pathlib import Path

SHAPES = {"vgg16": {"frames": (4, 6)}, "vgg16_box": {"frames": (4, 9)}, "neighbours": {"past": (3, 3)}}


def write_layers(path: str | Path, layers: Sequence[tuple[str, dict]]) -> None:
    content = {"config": {"layers": [{"class_name": kind, "config": settings} for kind, settings in layers]}}
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("config.json", json.dumps(content))


def write_model(path: str | Path, label: str, **shapes: Sequence[int]) -> None:
    """A model that is taken for one of a surrogate, with four input frames unless other shapes of inputs are given."""
    inputs = shapes or SHAPES[label]
    layers = [("InputLayer", {"name": name, "batch_shape": [None, *shape]}) for name, shape in inputs.items()]
    write_layers(path, [*layers, *([("Ensemble", {"shape": {"cutoff": 1.6}})] if label == "neighbours" else [])])
