"""What a stored model was trained on: the file beside it that says so, and whether a run is the same in this."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from slurrycast.runtime.files import InputError, write_text

FILE = "trained_on.json"  # beside model.keras or model.json
LIMITS = ("training_min", "training_max", "low", "high")  # of each quantity in its range


def _are(kind: type, values: Any) -> bool:
    return isinstance(values, list) and all(type(value) is kind for value in values)


def _is_range(quantities: Any) -> bool:
    return isinstance(quantities, dict) and all(
        isinstance(limits, dict) and limits.keys() == {*LIMITS} and {*map(type, limits.values())} <= {int, float}
        for limits in quantities.values()
    )


# What it holds: what is allowed for each key, in words and as a test.
ALLOWED = {
    "surrogate": ("text", lambda value: isinstance(value, str)),
    "model_sha256": ("text", lambda value: isinstance(value, str)),
    "slurries": ("a list of ids", lambda value: _are(str, value)),
    "input_frames": ("a list of whole numbers", lambda value: _are(int, value)),
    "target_frame": ("a whole number", lambda value: type(value) is int),
    "phases": ("a list of names", lambda value: _are(str, value)),
    "recipes": ("a list of at least one recipe, each a mapping", lambda value: _are(dict, value) and value != []),
    "range": (f"a mapping of quantities to numbers {', '.join(LIMITS)}", _is_range),
}


def recipe_of(physics: Mapping) -> dict:
    """What of the physics of a slurry is its recipe; its size and shape, and how its DEM is run, are left out."""
    return {"phases": physics["formulation"]["phases"], "force_field": physics["force_field"]}


def distinct(recipes: Sequence[Mapping]) -> list[Mapping]:
    """The recipes without those that were there before."""
    return [recipe for place, recipe in enumerate(recipes) if recipe not in recipes[:place]]


def write_trained_on(path: str | Path, known: Mapping) -> None:
    """Write the description of a model, with the keys of ALLOWED; an empty one where nothing is known."""
    write_text(path, json.dumps(dict(known), indent=1, ensure_ascii=False) + "\n")


def read_trained_on(path: str | Path) -> dict | None:
    """Read the description of a model; None if there is no file, or nothing in it. InputError if it is none."""
    path = Path(path)
    try:
        known = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not readable JSON ({' '.join(str(error).split())})") from error
    if known == {}:
        return None
    if not isinstance(known, dict) or any(key not in known for key in ALLOWED):
        raise InputError(f"{path}: does not say what a model was trained on: must hold {', '.join(ALLOWED)}")
    for key, (allowed, is_allowed) in ALLOWED.items():
        if not is_allowed(known[key]):
            raise InputError(f"{path}: {key}: must be {allowed}")
    return known


def beside(model: str | Path) -> Path:
    """Where the description of a model is."""
    return Path(model).with_name(FILE)
