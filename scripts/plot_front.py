"""Plot the structural error of every surrogate after relaxation against what it costs, and which are on the front.

In: tables/front.csv, tables/structure_errors.csv for the scatter of DEM replicas, tables/equilibrium.csv for the roles,
and tables/speedup.csv for what the DEM up to its own equilibrium costs.
Out: PNG, one panel for the density and one for the RDF; a point is the mean over the slurries of role test, the text
beside it names variant and last input frame (f10: frame 10). The band is the noise of the DEM, within which order is
not resolved: of the density, 2 sd of replicas; of the RDF, the mean difference between two replicas. Bold text marks
the front: neither another surrogate nor the full DEM, which has no error, is at most as dear and better.
"""

import argparse
import re
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator
from matplotlib.transforms import Bbox

from slurrycast.command_line import Parser, input_file, run_main
from slurrycast.figures import DEM, FAINT, INK, new_figure, save_figure, surrogate_colours, surrogate_family
from slurrycast.files import InputError
from slurrycast.front import equilibrium_share, mean_front, on_front, replica_band
from slurrycast.noise import BAND_SDS
from slurrycast.tables import read_equilibrium, read_table

MARKERS = "osD^vPX*<>"
PANELS = {
    "density_error": ("Density", "|density / DEM − 1| after relaxation (%)", 100.0, f"{BAND_SDS} sd of replicas"),
    "rdf_error": (
        "RDF, all pairs",
        "mean |g − g of the DEM| after relaxation",
        1.0,
        "mean difference between two replicas",
    ),
}
FULL = "full DEM (no error: below the axis)"
MARGIN = 1.25  # above and below the points
SIDES = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1))
DISTANCES_PT = (6, 11, 17, 25)


def short_name(label: str, family: str, last_frame: int) -> str:
    """What is special about `label` in its family: variant and last input frame."""
    variant = re.sub(r"_f\d+$", "", label)[len(family) :].lstrip("_").replace("_", " ")
    return f"{variant} f{last_frame:02d}".lstrip()


def place_names(axes: Axes, names: Sequence[tuple[str, float, float, str]]) -> None:
    """Write each (text, x, y, weight) beside its point, where it covers the fewest points and earlier texts."""
    axes.figure.draw_without_rendering()  # the layout has to be known
    inside = axes.get_window_extent()
    taken = [Bbox.from_bounds(*(axes.transData.transform((x, y)) - 4), 8, 8) for _, x, y, _ in names]
    for text, x, y, weight in names:
        options = [
            axes.annotate(
                text,
                (x, y),
                xytext=(side * distance, up * distance),
                textcoords="offset points",
                ha=("center", "left", "right")[side],
                va=("center", "bottom", "top")[up],
                fontsize=8 if weight == "bold" else 7,
                weight=weight,
            )
            for distance, (side, up) in product(DISTANCES_PT, SIDES)
        ]
        boxes = [option.get_window_extent() for option in options]
        covered = [
            sum(box.overlaps(other) for other in taken)
            + 2 * (not (inside.containsx(box.x0) and inside.containsx(box.x1)))
            + 2 * (not (inside.containsy(box.y0) and inside.containsy(box.y1)))
            for box in boxes
        ]
        best = int(np.argmin(covered))
        taken.append(boxes[best])
        for option in (*options[:best], *options[best + 1 :]):
            option.remove()


def draw_panel(
    axes: Axes, points: pd.DataFrame, column: str, band: float, markers: Mapping[str, str], equilibrium: float
) -> None:
    """Draw one panel; `points` are rows of `front.mean_front`, `band` in units of `column`, NaN for none.

    `equilibrium` is the cost share of the DEM up to its own equilibrium, NaN for none.
    """
    title, ylabel, scale, band_words = PANELS[column]
    cost, error = 100 * points.cost_share_of_full_dem, scale * points[column]
    colours = surrogate_colours(list(markers))
    axes.set(xscale="log", yscale="log", title=title, xlabel="Cost (% of the full DEM, CPU time)", ylabel=ylabel)
    front = on_front(points.cost_share_of_full_dem, points[column])
    axes.plot(cost[front], error[front], color=INK, linewidth=1.1, zorder=2, label="front")
    for family, marker in markers.items():
        own = points.family == family
        axes.plot(cost[own], error[own], marker, color=colours[family], markeredgecolor="white", ms=8, label=family)
    lowest, highest = error.min() / MARGIN, MARGIN * max(error.max(), scale * band if band > 0 else 0)
    axes.set_ylim(bottom=lowest, top=highest)
    axes.set_xlim(0.6 * min(cost.min(), 100 * equilibrium if equilibrium > 0 else np.inf), 1.3 * max(cost.max(), 100.0))
    axes.axvline(100, color=DEM, linestyle="--", linewidth=1.2)
    if equilibrium > 0:
        axes.axvline(100 * equilibrium, color=DEM, linestyle=":", linewidth=1.4, label="DEM to its own equilibrium")
    # no error has no place on a logarithmic axis
    axes.plot(100, 0, "*", transform=axes.get_xaxis_transform(), clip_on=False, color=DEM, ms=13, zorder=4, label=FULL)
    if band > 0:
        axes.axhspan(
            lowest, scale * band, color=FAINT, alpha=0.5, linewidth=0, label="noise of the DEM: order not resolved"
        )
        axes.set_title(f"{title} (band: {band_words})")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 5, 7)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())


def draw_front(points: pd.DataFrame, band: Mapping[str, float], equilibrium: float) -> Figure:
    """Draw both panels; `points` as `front.mean_front` returns them, `band` as `front.replica_band` does.

    `equilibrium` is the cost share of the DEM up to its own equilibrium, NaN for none.
    """
    points = points.assign(family=[surrogate_family(label, points.surrogate) for label in points.surrogate])
    families = list(dict.fromkeys(points.family))
    markers = {family: MARKERS[place % len(MARKERS)] for place, family in enumerate(families)}
    figure = new_figure(11.0, 5.4)
    panels = figure.subplots(1, 2)
    for axes, column in zip(panels, PANELS, strict=True):
        draw_panel(axes, points, column, band[column], markers, equilibrium)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=min(len(families) + 4, 5))
    for axes, column in zip(panels, PANELS, strict=True):
        front = on_front(points.cost_share_of_full_dem, points[column])
        names = [
            (
                short_name(row.surrogate, row.family, row.input_last_frame),
                100 * row.cost_share_of_full_dem,
                PANELS[column][2] * getattr(row, column),
                "bold" if named else "normal",
            )
            for row, named in zip(points.itertuples(), front, strict=True)
        ]
        place_names(axes, sorted(names, key=lambda name: name[3]))
    return figure


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument("--front", type=input_file, required=True, help="in: tables/front.csv")
    parser.add_argument("--structure-errors", type=input_file, required=True, help="in: tables/structure_errors.csv")
    parser.add_argument("--equilibrium", type=input_file, required=True, help="in: tables/equilibrium.csv")
    parser.add_argument("--speedup", type=input_file, required=True, help="in: tables/speedup.csv")
    parser.add_argument("--figure", type=Path, required=True, help="out: PNG")
    return parser.parse_args()


def main() -> None:
    """Read the tables and draw."""
    args = parse_args()
    table, equilibrium = read_table(args.front), read_equilibrium(args.equilibrium)
    table = table[table.slurry.isin(equilibrium.slurry[equilibrium.role == "test"])]
    if table.empty:
        raise InputError(f"{args.front}: no slurry of role test")
    points = mean_front(table)
    test = set(table.slurry)
    band = replica_band(read_table(args.structure_errors), test)
    save_figure(draw_front(points, band, equilibrium_share(read_table(args.speedup), test, "cpu_s")), args.figure)


if __name__ == "__main__":
    run_main(main)
