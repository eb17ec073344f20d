"""Labels, by which a run names surrogates: `affine`, `affine_f02`, `early_dem_x10`, `early_dem_x10_f02`.

A label is the name of a surrogate, for some a variant, and for some the last input frame.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from slurrycast.runtime.files import InputError
from slurrycast.surrogates.base import Surrogate
from slurrycast.surrogates.registry import NAMES, load

_FRAME = re.compile(r"_f(\d{2,})$")


@dataclass(frozen=True)
class Label:
    """A surrogate as a run names it.

    Attributes
    ----------
    text
        The label itself.
    name
        Name of the surrogate.
    settings
        Settings that the variant stands for.
    last_frame
        Last input frame that the label names, None for that of the configuration.
    """

    text: str
    name: str
    settings: Mapping[str, str]
    last_frame: int | None

    @property
    def surrogate(self) -> Surrogate:
        """The surrogate itself."""
        return load(self.name)

    @property
    def without_frame(self) -> str:
        """The label without its last input frame: `early_dem_x10` for `early_dem_x10_f02`."""
        return self.text if self.last_frame is None else _FRAME.sub("", self.text)

    def input_frames(self, configured: Sequence[int]) -> list[int]:
        """Input frames: the configured ones, or as many up to the last frame that the label names.

        Frame 0, the start, of a surrogate that needs nothing of the DEM.
        """
        if self.surrogate.from_recipe:
            return [0]
        if self.last_frame is None:
            return list(configured)
        return list(range(max(0, self.last_frame - len(configured) + 1), self.last_frame + 1))


def parse(text: str) -> Label:
    """Take a label apart. InputError if there is no such surrogate or variant."""
    name = family(text)
    if name not in NAMES:
        raise InputError(f"surrogate: {text!r} is not known, allowed: {', '.join(NAMES)}")
    frame = _FRAME.search(text)
    variant = _FRAME.sub("", text)[len(name) :]
    pattern = load(name).variant
    if not variant and (pattern is None or pattern.fullmatch("")):
        settings = {}
    elif variant and pattern is not None and (match := pattern.fullmatch(variant.removeprefix("_"))):
        settings = match.groupdict()
    else:
        what = name if pattern is None else f"{name}_ and a variant that matches {pattern.pattern}"
        raise InputError(f"surrogate: {text!r} is not known: must be {what}, and _f<NN> for the last input frame")
    return Label(text, name, settings, None if frame is None else int(frame[1]))


def family(text: str, labels: Sequence[str] = ()) -> str:
    """Name of the surrogate that a label belongs to; tables may hold labels of surrogates that are not known here.

    It is the longest known name that the label begins with. Without any it is the shortest of `labels` that it begins
    with, or else the label without its last input frame.
    """
    plain = re.sub(r"_f\d+$", "", text)

    def beginnings(names: Sequence[str]) -> list[str]:
        return [name for name in names if plain == name or plain.startswith(f"{name}_")]

    return max(beginnings(NAMES), key=len, default=min(beginnings(labels), key=len, default=plain))


def main_labels(labels: Sequence[str]) -> list[str]:
    """The labels without those of earlier input frames, and without variants of a label that is there itself."""
    plain = [label for label in labels if family(label) == label]
    others = [label for label in labels if family(label) not in plain]
    kept = {*plain, *(label for label in others if not any(label.startswith(f"{other}_f") for other in others))}
    return [label for label in labels if label in kept]
