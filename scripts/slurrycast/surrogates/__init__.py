"""The surrogates: what jumps from early frames to the equilibrated one, learned or not.

A new one is a module, a line in the registry below and a paragraph in the documentation. A surrogate is a module with

    NAME            as in the configuration and in paths
    LOOKS_AT        what its prediction for a particle may depend on, in words for the report
    BOX_RULE        which rule gives the final box: one of final_box.RULES
    MODEL_FILE      "model.keras" (trained, with learning curves), "model.json" (fitted in closed form), or None:
                    nothing is learned
    MODEL_LAYER     optional, of a model.keras: class of a layer that each file of this kind has
    WEIGHTS_OF      of a model.keras: whose weights it has, of the epoch of the "lowest" validation loss or the "last"
    LEARNS_FROM     "samples" (particles of the training set, whatever their slurry), "frames" (whole slurries; then a
                    label may have a last input frame of its own), or None
    CONTINUES_DEM   script of scripts/lammps by which it goes on with the DEM from the restart file at the last input
                    frame, or None; then most_steps(settings) is how many steps that takes at most
    HAS_SPREAD      whether its predictions have a spread, from which their uncertainty is calibrated
    VARIANT         pattern of the variants that a label may name, its groups becoming settings; or None
    fit(training_set, settings, model_path, history_path, work_directory) -> dict       of a model.keras
                    trains and writes the model and history.csv (epoch,loss,mae,val_loss,val_mae); returns
                    wall_s and cpu_s that attempts before a kill have spent; the work directory is its own, to resume
                    from
                    from frames: fit(slurries, validation, settings, ...), two lists of trajectories.Trajectory with the
                    frames that needed_frames(settings, edges_um, moved=...) names; settings has input_frames and
                    target_frame
    fit(training_set, settings, model_path)                                              of a model.json
    first_frame_seen(input_frames, settings) -> int       of what learns from other last input frames than it is asked
                    with too: the earliest of them
    input_shapes(n_frames, settings) -> dict       of a model.keras: shapes by which one made elsewhere is known to fit
    predict(inputs, model_path, settings) -> Prediction                                see prediction.py

`settings` are the surrogate's section of the configuration, the variant's groups, and `seed` for a fit. Modules are
imported by the Snakefile for their constants: they import Keras, LAMMPS and the like only inside functions.

A run names surrogates by labels: `affine`, `affine_f02` (the input frames end at frame 2), `early_dem_x10` (a variant),
`early_dem_x10_f02`.
"""

import importlib
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from slurrycast.runtime.files import InputError

_MODULES = {
    "persistence": "slurrycast.surrogates.persistence",
    "affine": "slurrycast.surrogates.affine",
    "linear": "slurrycast.surrogates.linear",
    "vgg16": "slurrycast.surrogates.vgg16",
    "vgg16_box": "slurrycast.surrogates.vgg16_box",
    "neighbours": "slurrycast.surrogates.neighbours",
    "driven_dem": "slurrycast.surrogates.driven_dem",
    "early_dem": "slurrycast.surrogates.early_dem",
}
NAMES = tuple(_MODULES)


@dataclass(frozen=True)
class Label:
    """A surrogate as a run names it: which one, its variant's settings, and the last input frame if it has its own."""

    text: str
    name: str
    settings: Mapping[str, str]
    last_frame: int | None

    def input_frames(self, configured: Sequence[int]) -> list[int]:
        """Input frames: the configured ones, or as many ending at the label's own frame, as far as frame 0."""
        if self.last_frame is None:
            return list(configured)
        return list(range(max(0, self.last_frame - len(configured) + 1), self.last_frame + 1))


def parse(label: str) -> Label:
    """Take a label apart. InputError if there is no such surrogate or variant."""
    fitting = [name for name in NAMES if label == name or label.startswith(f"{name}_")]
    if fitting:
        name = max(fitting, key=len)
        variant, frame = re.fullmatch(r"(.*?)(?:_f(\d{2,}))?", label[len(name) :]).groups()
        last_frame = None if frame is None else int(frame)
        pattern = load(name).VARIANT
        if not variant:
            if pattern is None or pattern.fullmatch(""):
                return Label(label, name, {}, last_frame)
        elif pattern is not None and (match := pattern.fullmatch(variant.removeprefix("_"))):
            return Label(label, name, match.groupdict(), last_frame)
        what = name if pattern is None else f"{name}_ and a variant that matches {pattern.pattern}"
        raise InputError(f"surrogate: {label!r} is not known: must be {what}, and _f<NN> for the last input frame")
    raise InputError(f"surrogate: {label!r} is not known, allowed: {', '.join(NAMES)}")


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
