"""Plot the error of every surrogate, before and after relaxation, against what it costs, and which are on the front.

In: tables/front.csv, tables/skill.csv for the coordinates, tables/structure_errors.csv for the scatter of DEM replicas,
tables/equilibrium.csv for the roles, and tables/speedup.csv for what the DEM up to its own equilibrium costs.
Out: PNG, one panel for the coordinates as predicted, as a share of the affine map's error, and below it one for the
density and one for the RDF after relaxation. A point is the mean over the slurries of role test. A surrogate that is
there with several last input frames is one line in their order, with the numbers of the frames beside its points. The
band is the noise of the DEM, within which order is not resolved: of the density, 2 sd of replicas; of the RDF, the mean
difference between two replicas. A dark rim marks the front: neither another surrogate nor the full DEM, which has no
error, is better at the same or lower cost. A surrogate without coordinates, such as `direct`, is in the lower panels
alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from matplotlib.transforms import Bbox

from slurrycast import surrogates
from slurrycast.data.tables import read_equilibrium, read_table
from slurrycast.evaluation.front import equilibrium_share, mean_front, on_front, replica_band, with_relative_mse
from slurrycast.evaluation.noise import BAND_SDS
from slurrycast.report.figures import (
    DEM,
    FAINT,
    INK,
    SURROGATE_MARKERS,
    annotate_beside,
    new_figure,
    plain_ticks,
    save_figure,
    surrogate_colours,
)
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError


@dataclass(frozen=True)
class Panel:
    """What a panel shows: title, axis, its factor on the column of the table, and what the band is."""

    title: str
    ylabel: str
    scale: float
    band: str
    most: float = np.inf  # errors beyond are drawn at the upper edge and written
    reference: str = ""  # what an error of 1 is


PANELS = {
    "mse_of_affine": Panel(
        "Coordinates, before relaxation (numbers: last input frame)", "MSE / MSE of affine", 1.0, "", 2.0, "affine map"
    ),
    "density_error": Panel(
        "Density, after relaxation", "|density / DEM − 1| (%)", 100.0, f"band: {BAND_SDS} sd of replicas"
    ),
    "rdf_error": Panel(
        "RDF of all particles, after relaxation", "mean |g − g of the DEM|", 1.0, "band: between two replicas"
    ),
}
FULL = "full DEM (no error: below the axis)"
MARGIN = 1.25  # above and below the points
SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1), (-1, 1))
HORIZONTAL, VERTICAL = ("center", "left", "right"), ("center", "bottom", "top")  # by side and up, -1 is the last
DISTANCES_PT = (6, 11, 17)
ON_LINE = np.linspace(0, 1, 20)[:, None]  # where texts look whether they would cover a line


def plain_label(label: str) -> str:
    """The label without its last input frame: `early_dem_x10` of `early_dem_x10_f02`."""
    return surrogates.parse(label).without_frame


def place_numbers(axes: Axes, points: np.ndarray, numbers: Mapping[int, str], lines: Sequence[Sequence[int]]) -> None:
    """Write each text of `numbers` beside its point (by place in `points`, (n, 2)), where it covers least.

    It may cover points, earlier texts and the `lines` through points (by their places in order).
    """
    axes.figure.draw_without_rendering()  # the layout has to be known
    inside, shown = axes.get_window_extent(), axes.transData.transform(points)
    taken = [Bbox.from_bounds(x - 8, y - 8, 16, 16) for x, y in shown]
    for start, end in (pair for line in lines for pair in pairwise(line)):
        taken += [Bbox.from_bounds(x - 1, y - 1, 2, 2) for x, y in shown[start] + ON_LINE * (shown[end] - shown[start])]
    for place, text in numbers.items():
        options = []
        for distance, (side, up) in product(DISTANCES_PT, SIDES):
            offset_pt, sides = (side * distance, up * distance), {"ha": HORIZONTAL[side], "va": VERTICAL[up]}
            options.append(annotate_beside(axes, text, points[place], offset_pt, **sides))
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
    """Draw one panel; `points` are rows of `front.mean_front` with `plain`, `band` in units of `column`, NaN for none.

    Points without an error are left out. `markers` are those of the plain labels. `equilibrium` is the cost share of
    the DEM up to its own equilibrium, NaN for none.
    """
    panel, points = PANELS[column], points[points[column].notna()].reset_index(drop=True)
    cost, error = 100 * points.cost_share_of_full_dem, panel.scale * points[column]
    beyond = error > panel.most
    colours = surrogate_colours(list(markers))
    axes.set(xscale="log", yscale="log", xlabel="Cost (% of the full DEM, CPU time)", ylabel=panel.ylabel)
    axes.set_title(f"{panel.title} ({panel.band})" if band > 0 else panel.title)
    front = on_front(points.cost_share_of_full_dem, points[column])
    axes.plot(cost[front], error[front], color=INK, linewidth=1.1, linestyle=(0, (1, 1.5)), zorder=2, label="front")
    for plain, marker in markers.items():
        places = points[points.plain == plain].sort_values("input_last_frame").index
        axes.plot(
            cost[places], error[places], marker=marker, color=colours[plain], mec="white", mew=0.6, ms=7.5, label=plain
        )
        rim = places[front[places]]
        axes.plot(cost[rim], error[rim], marker, color=colours[plain], mec=INK, mew=1.2, ms=7.5)
    shown = [*error[~beyond], *([1.0] if panel.reference else []), *([panel.scale * band] if band > 0 else [])]
    lowest, highest = min([*error, *shown]) / MARGIN, max(shown) * MARGIN
    axes.set_ylim(bottom=lowest, top=highest)
    at_edge = {"transform": axes.get_xaxis_transform(), "clip_on": False}
    for place in points.index[beyond]:
        axes.plot(cost[place], 1, "^", color=colours[points.plain[place]], ms=9, **at_edge)
        text = f"{points.surrogate[place]}: {error[place]:.1f}"
        annotate_beside(axes, text, (cost[place], 1), (8, -2), xycoords=("data", "axes fraction"), va="top")
    if panel.reference:
        axes.axhline(1, color=INK, linewidth=0.9, zorder=1)
        annotate_beside(axes, panel.reference, (1, 1), (-4, 3), xycoords=("axes fraction", "data"), ha="right")
    axes.set_xlim(0.8 * min(cost.min(), 100 * equilibrium if equilibrium > 0 else np.inf), 1.3 * max(cost.max(), 100.0))
    axes.axvline(100, color=DEM, linestyle="--", linewidth=1.2)
    if equilibrium > 0:
        axes.axvline(100 * equilibrium, color=DEM, linestyle="-.", linewidth=1.4, label="DEM to its own equilibrium")
    # no error has no place on a logarithmic axis
    axes.plot(100, 0, "*", color=DEM, ms=13, zorder=4, label=FULL, **at_edge)
    if band > 0:
        label = "noise of the DEM: order not resolved"
        axes.axhspan(lowest, panel.scale * band, color=FAINT, alpha=0.5, lw=0, label=label)
    fine = (1, 1.5, 2, 3, 5, 7)
    plain_ticks(axes.xaxis, LogLocator(subs=fine))
    plain_ticks(axes.yaxis, LogLocator(subs=fine if highest < 20 * lowest else (1, 2, 5)))


def draw_front(points: pd.DataFrame, band: Mapping[str, float], equilibrium: float) -> Figure:
    """Draw all panels; `points` as `front.mean_front` returns them, `band` as `front.replica_band` does.

    `equilibrium` is the cost share of the DEM up to its own equilibrium, NaN for none.
    """
    points = points.assign(plain=points.surrogate.map(plain_label)).reset_index(drop=True)
    plain = list(dict.fromkeys(points.plain))
    markers = dict(zip(plain, SURROGATE_MARKERS * len(plain), strict=False))
    figure = new_figure(11.0, 9.0)
    panels = figure.subplot_mosaic([["mse_of_affine"] * 2, ["density_error", "rdf_error"]])
    for column, axes in panels.items():
        draw_panel(axes, points, column, band.get(column, np.nan), markers, equilibrium)
    axes = panels["density_error"]  # has what all have, and the band
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper left", ncols=5)
    for column, axes in panels.items():
        drawn = points[points[column].notna()].reset_index(drop=True)
        by_frame = drawn.sort_values("input_last_frame").groupby("plain", sort=False)
        lines = [list(frames.index) for _, frames in by_frame if len(frames) > 1]
        numbers = {place: f"{drawn.input_last_frame[place]}" for line in lines for place in line}
        places = np.column_stack([100 * drawn.cost_share_of_full_dem, PANELS[column].scale * drawn[column]])
        place_numbers(axes, places, numbers, lines)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("front", "skill", "structure_errors", "equilibrium", "speedup")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the tables and draw."""
    table, equilibrium = read_table(args.front), read_equilibrium(args.equilibrium)
    table = table[table.slurry.isin(equilibrium.slurry[equilibrium.role == "test"])]
    if table.empty:
        raise InputError(f"{args.front}: no slurry of role test")
    table = with_relative_mse(table, read_table(args.skill))
    if table.mse_of_affine.isna().all():
        raise InputError(f"{args.skill}: no surrogate and slurry of {args.front}")
    points = mean_front(table)
    test = set(table.slurry)
    band = replica_band(read_table(args.structure_errors), test)
    save_figure(draw_front(points, band, equilibrium_share(read_table(args.speedup), test, "cpu_s")), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
