"""One look for all figures: colours with a fixed meaning, readable sizes, labels with units, PNG at 150 dpi."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from slurrycast.runtime.environment import LIBRARIES

os.environ |= LIBRARIES

from matplotlib import rcdefaults, rcParams
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation
from matplotlib.ticker import Locator, NullLocator
from PIL import Image

from slurrycast.runtime.files import moved_into_place
from slurrycast.surrogates import family

DPI = 150
INK, FAINT = "#22303c", "#c9d0d6"
PHASE_COLOURS = {"BDPD": "#dfb96f", "NiO": "#3f8f68", "8YSZ": "#4f78b8"}
FURTHER_PHASE_COLOURS = ("#9b6a9e", "#c0694e", "#7a8794", "#8a8f3c")
# what a structure or curve stands for, in every figure
DEM, PREDICTED, RELAXED = "#22303c", "#e08a3c", "#18858f"
TRAINING, VALIDATION = DEM, PREDICTED
HELD_OUT = {"validation": "#b8952e", "test": "#5f5aa8"}  # whole slurries, by role
ARTICLE = "#a3234e"
SURROGATE_COLOURS = {
    "direct": "#d62020",
    "direct_box": "#f09a9a",
    "persistence": "#8c6d55",
    "affine": "#e08a3c",
    "linear": "#8a8f3c",
    "linear_box": "#b3446c",
    "vgg16": "#18858f",
    "vgg16_box": "#3f63b8",
    "neighbours": "#2f9e44",
    "driven_dem": "#12a5d1",
    "early_dem": "#9b4fa0",
}
FURTHER_SURROGATE_COLOURS = ("#c0694e", "#3f8f68", "#b8952e", "#5f5aa8", "#4a6a7a")
SURROGATE_MARKERS = "osD^vPX*<>hpd8"
PALEST = 0.62  # share of white in the last variant of a family

STYLE = {
    "font.family": "sans-serif",
    "font.size": 10,
    "axes.titlesize": 10.5,
    "axes.labelsize": 10,
    "axes.titleweight": "bold",
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#e7eaed",
    "grid.linewidth": 0.7,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "text.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.linewidth": 1.6,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
}


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure in the common style; it needs no display."""
    rcdefaults()  # a matplotlibrc in the working directory is read in any case
    rcParams.update(STYLE)
    return Figure(figsize=(width_in, height_in), layout="constrained")


def save_figure(figure: Figure, path: str | Path, colours: int | None = None) -> None:
    """Write `figure` to `path` (PNG) in one move; with `colours`, as a palette of so many, a third of the size."""
    with moved_into_place(path) as part:
        figure.savefig(part, dpi=DPI, bbox_inches="tight", pad_inches=0.08)
        if colours is not None:
            with Image.open(part) as image:
                palette = image.convert("RGB").quantize(colours, dither=Image.Dither.NONE)
            palette.save(part, "PNG", optimize=True)


def phase_colours(phase_names: Sequence[str]) -> list[str]:
    """Colour of each phase; phases that the published recipe does not have take further colours in their order."""
    further = iter(FURTHER_PHASE_COLOURS * len(phase_names))
    return [PHASE_COLOURS.get(name) or next(further) for name in phase_names]


def phase_handles(phase_names: Sequence[str], size_pt: float) -> list[Line2D]:
    """Return a dot for each phase, of this size in points, for a legend."""
    colours = zip(phase_names, phase_colours(phase_names), strict=True)
    return [Line2D([], [], ls="", marker="o", ms=size_pt, color=colour, label=name) for name, colour in colours]


def surrogate_colours(labels: Sequence[str]) -> dict[str, str]:
    """Colour of each surrogate label: a family keeps its own, its variants get paler in their order.

    The label that is only the family's name, or else the first one, has the full colour. Families that are not known
    take further colours in their order.
    """
    families: dict[str, list[str]] = {}
    for label in dict.fromkeys(labels):
        families.setdefault(family(label, labels), []).append(label)
    further = iter(FURTHER_SURROGATE_COLOURS * (len(families) + 1))
    colours = {}
    for name, members in families.items():
        red, green, blue = to_rgb(SURROGATE_COLOURS.get(name) or next(further))
        members.sort(key=lambda label: label != name)
        for place, label in enumerate(members):
            white = PALEST * place / max(len(members) - 1, 1)
            colours[label] = to_hex([channel + (1 - channel) * white for channel in (red, green, blue)])
    return {label: colours[label] for label in labels}


def plain_ticks(axis: Axis, locator: Locator) -> None:
    """Put ticks on an axis, such as a logarithmic one, only where `locator` says, with plain numbers."""
    axis.set_major_locator(locator)
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def annotate_beside(axes: Axes, text: str, place: tuple, offset_pt: tuple[float, float], **style: Any) -> Annotation:
    """Write `text` at an offset in points from `place`, by default in units of the data."""
    return axes.annotate(text, place, offset_pt, textcoords="offset points", **{"fontsize": 8} | style)


def note(axes: Axes, text: str, x: float = 0.5, y: float = 0.5) -> None:
    """Write `text` into `axes` at a place in units of its size, centred."""
    axes.text(x, y, text, transform=axes.transAxes, ha="center", va="center", color=INK, linespacing=1.4)
