"""One look for all figures: colours with a fixed meaning, readable sizes, labels with units, PNG at 150 dpi."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slurrycast.files import moved_into_place

DPI = 150
INK, FAINT = "#22303c", "#c9d0d6"
PHASE_COLOURS = {"BDPD": "#dfb96f", "NiO": "#3f8f68", "8YSZ": "#4f78b8"}
FURTHER_PHASE_COLOURS = ("#9b6a9e", "#c0694e", "#7a8794", "#8a8f3c")
# what a structure or curve stands for, in every figure
DEM, PREDICTED, RELAXED = "#22303c", "#e08a3c", "#18858f"
TRAINING, VALIDATION = DEM, PREDICTED
STUDY = "#a3234e"

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
    rcParams.update(STYLE)
    return Figure(figsize=(width_in, height_in), layout="constrained")


def save_figure(figure: Figure, path: str | Path) -> None:
    """Write `figure` to `path` (PNG) in one move."""
    with moved_into_place(path) as part:
        figure.savefig(part, dpi=DPI, bbox_inches="tight", pad_inches=0.08)


def phase_colours(phase_names: Sequence[str]) -> list[str]:
    """Colour of each phase; phases that the published recipe does not have take further colours in their order."""
    further = iter(FURTHER_PHASE_COLOURS * len(phase_names))
    return [PHASE_COLOURS.get(name) or next(further) for name in phase_names]


def note(axes: Axes, text: str, x: float = 0.5, y: float = 0.5) -> None:
    """Write `text` into `axes` at a place in units of its size, centred."""
    axes.text(x, y, text, transform=axes.transAxes, ha="center", va="center", color=INK, linespacing=1.4)
