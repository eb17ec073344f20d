"""The layers of a saved Keras network, read from the file itself: no Keras is needed to write a report.

A .keras file is a zip of config.json (the architecture) and model.weights.h5.
"""

import json
import zipfile
from dataclasses import dataclass, replace
from math import prod
from pathlib import Path

import h5py

from slurrycast.runtime.files import InputError


@dataclass(frozen=True)
class Layer:
    """One layer: what it is, the shape that leaves it (without the batch), and its trained parameters."""

    name: str
    output_shape: tuple[int, ...] | None
    parameters: int | None


@dataclass(frozen=True)
class Network:
    """All layers in order, and the number of parameters that the weights file holds."""

    layers: tuple[Layer, ...]
    parameters: int


def describe_layer(kind: str, settings: dict, shape: tuple[int, ...] | None) -> Layer:
    """Name, output shape and parameters of a layer that `shape` enters; None where they do not follow from it.

    Length L after a convolution of "same" padding and stride 1 is L, after pooling of "same" padding ceil(L / stride).
    """
    if kind == "InputLayer":
        return Layer("Input", tuple(settings["batch_shape"][1:]), 0)
    if kind == "Ensemble":
        layers = f"{len(settings['shape']['shares'])} layers of width {settings['shape']['width']}"
        return Layer(f"Ensemble of {settings['n_members']} networks, {layers}", None, None)
    if shape is None:
        return Layer(kind, None, None)
    bias = settings.get("use_bias", False)
    if kind == "Conv1D" and settings["padding"] == "same" and settings["strides"] == [1]:
        filters, width = settings["filters"], settings["kernel_size"][0]
        name = f"Conv1D {filters}, kernel {width}, {settings['activation']}"
        return Layer(name, (shape[0], filters), (width * shape[1] + bias) * filters)
    if kind in ("Normalization", "Rescaling"):
        return Layer(kind, shape, 0)  # numbers in the configuration, none in the weights file
    if kind == "MaxPooling1D" and settings["padding"] == "same":
        stride = settings["strides"][0]
        return Layer(f"MaxPooling1D {settings['pool_size'][0]}", (-(-shape[0] // stride), shape[1]), 0)
    if kind == "Flatten":
        return Layer("Flatten", (prod(shape),), 0)
    if kind == "Dense":
        units = settings["units"]
        name = f"Dense {units}, {settings['activation']}"
        return Layer(name, (*shape[:-1], units), (shape[-1] + bias) * units)
    return Layer(kind, None, None)


def read_network(path: str | Path) -> Network:
    """Describe the network in a .keras file. InputError if it is no such file."""
    try:
        with zipfile.ZipFile(path) as archive:
            configuration = json.loads(archive.read("config.json"))["config"]
            with archive.open("model.weights.h5") as weights, h5py.File(weights, "r") as file:
                parameters = _count_parameters(file["layers"])
    except (OSError, KeyError, zipfile.BadZipFile, json.JSONDecodeError) as error:
        raise InputError(f"{path}: not a readable .keras file ({error})") from error
    layers, shape = [], None
    several = sum(layer["class_name"] == "InputLayer" for layer in configuration["layers"]) > 1
    for layer in configuration["layers"]:
        kind, settings = layer["class_name"], layer["config"]
        described = describe_layer(kind, settings, shape)
        if kind == "InputLayer" and several:
            described = replace(described, name=f"Input {settings['name']}")
        if kind == "Ensemble":
            described = replace(described, parameters=parameters)  # all other layers are inputs
        layers.append(described)
        shape = described.output_shape
    return Network(tuple(layers), parameters)


def _count_parameters(weights: h5py.Group) -> int:
    sizes = []
    weights.visititems(lambda _, item: sizes.append(item.size if isinstance(item, h5py.Dataset) else 0))
    return sum(sizes)
