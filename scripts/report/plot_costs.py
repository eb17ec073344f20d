"""Plot what the hybrid chain of every surrogate costs for each slurry, part by part, beside the full DEM.

In: tables/speedup.csv (seconds).
Out: PNG with one panel for each surrogate. Each slurry has a bar with the parts of its hybrid run, marks where the DEM
is in equilibrium and where it ends, and how many times the hybrid run fits in these.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slurrycast.data.tables import read_table
from slurrycast.evaluation.speedup import HYBRID_PARTS, time_unit
from slurrycast.report.figures import DEM, FAINT, INK, PREDICTED, RELAXED, new_figure, save_figure
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

PART_COLOURS = dict(zip(HYBRID_PARTS, ("#6d4c7d", "#a9b8c6", "#dfb96f", PREDICTED, FAINT, RELAXED), strict=True))
COLUMNS = 2


def draw_panel(axes: Axes, slurries: pd.DataFrame, stages: Sequence[str], length_s: float) -> None:
    """Draw `stages` of the slurries of one surrogate in units of `length_s` seconds."""
    places, start = np.arange(len(slurries)), np.zeros(len(slurries))
    for stage in stages:
        width = slurries[stage].to_numpy() / length_s
        axes.barh(places, width, 0.62, left=start, color=PART_COLOURS[stage], label=HYBRID_PARTS[stage])
        start = start + width
    for seconds, marker, label in (
        (slurries.dem_to_equilibrium, "d", "DEM to equilibrium"),
        (slurries.dem, "|", "full DEM"),
    ):
        if seconds.notna().any():
            size, edge, width = (8, "white", 1) if marker == "d" else (13, DEM, 2)
            axes.plot(seconds / length_s, places, marker, color=DEM, mec=edge, mew=width, ms=size, label=label)
    for place, row in enumerate(slurries.itertuples()):
        if not np.isnan(row.ratio):
            text = f"{row.ratio:.1f} ×"
            if not np.isnan(row.ratio_to_equilibrium):
                text += f" ({row.ratio_to_equilibrium:.1f} ×)"
            at = (max(row.hybrid, row.dem) / length_s, place)
            axes.annotate(text, at, (7, 0), textcoords="offset points", va="center", fontsize=8.5, color=INK)
    axes.set(yticks=places, yticklabels=slurries.slurry)
    axes.grid(axis="y", visible=False)


def draw_costs(comparison: pd.DataFrame) -> Figure:
    """Draw a panel for each surrogate; rows of `comparison` as `speedup.compare_costs` returns them, on one clock."""
    panels = dict(list(comparison.groupby("surrogate", sort=False)))
    columns = min(COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    slurries = max(map(len, panels.values()))
    figure = new_figure(5.6 * columns + 1.4, 0.9 + rows * (0.7 + 0.3 * slurries))
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
    stages = [stage for stage in HYBRID_PARTS if comparison[stage].any()]
    length_s, unit = time_unit(comparison[["dem", "hybrid"]].max(axis=None))
    for axes, (surrogate, table) in zip(grid.flat, panels.items(), strict=False):
        draw_panel(axes, table.reset_index(drop=True), stages, length_s)
        axes.set(title=surrogate, xlabel=f"Wall time ({unit})", ylabel="Slurry")
        axes.invert_yaxis()
        axes.xaxis.set_tick_params(labelbottom=True)
    for axes in grid.flat[len(panels) :]:
        axes.remove()
    # room for the text behind the longest run
    grid.flat[0].set_xlim(0, 1.25 * comparison[["dem", "hybrid"]].max(axis=None) / length_s)
    handles, labels = grid.flat[0].get_legend_handles_labels()
    title = None if comparison.ratio.isna().all() else "×: full DEM / hybrid (in brackets: DEM to equilibrium / hybrid)"
    style = {"ncols": 4, "columnspacing": 1.6, "handlelength": 1.2, "alignment": "left"}
    figure.legend(handles, labels, loc="outside upper left", title=title, **style)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("speedup")
    parser.add_value("--surrogates", "names in the table, one panel each", nargs="+")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the table and draw the bars."""
    wall = read_table(args.speedup).query("clock == 'wall_s'")
    for surrogate in args.surrogates:
        if surrogate not in set(wall.surrogate):
            raise InputError(f"--surrogates {surrogate}: not in {args.speedup}")
    shown = [wall[wall.surrogate == surrogate] for surrogate in args.surrogates]
    save_figure(draw_costs(pd.concat(shown)), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
