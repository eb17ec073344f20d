"""What a stored model was trained on: the file beside it that says so, and whether a run is the same in this."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from slurrycast.runtime.files import InputError, write_text

FILE = "trained_on.json"  # beside model.keras or model.json
# What it holds, and of which kind.
KINDS = {"surrogate": str, "model_sha256": str, "slurries": list, "input_frames": list, "target_frame": int}
KINDS |= {"phases": list, "recipes": list, "range": dict}


def recipe_of(physics: Mapping) -> dict:
    """What of the physics of a slurry is its recipe; its size and shape, and how its DEM is run, are left out."""
    return {"phases": physics["formulation"]["phases"], "force_field": physics["force_field"]}


def distinct(recipes: Sequence[Mapping]) -> list[Mapping]:
    """The recipes without those that were there before."""
    return [recipe for place, recipe in enumerate(recipes) if recipe not in recipes[:place]]


def write_trained_on(path: str | Path, known: Mapping) -> None:
    """Write the description of a model, with the keys of KINDS; an empty one where nothing is known."""
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
    if not isinstance(known, dict) or (known and any(key not in known for key in KINDS)):
        raise InputError(f"{path}: does not say what a model was trained on: must hold {', '.join(KINDS)}")
    if not known:
        return None
    nested = {"recipes": known["recipes"], "range": known["range"].values() if isinstance(known["range"], dict) else []}
    wrong = [key for key, kind in KINDS.items() if not isinstance(known[key], kind)]
    wrong += [key for key, items in nested.items() if key not in wrong and not all(isinstance(i, dict) for i in items)]
    if wrong or not known["recipes"]:
        raise InputError(f"{path}: {(wrong or ['recipes'])[0]}: not as describe_model writes it")
    return known


def beside(model: str | Path) -> Path:
    """Where the description of a model is."""
    return Path(model).with_name(FILE)
