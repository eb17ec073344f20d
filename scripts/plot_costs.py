"""Plot what the full DEM and the hybrid chain cost for each slurry, stage by stage.

In: tables/speedup.csv (seconds), the rows of one surrogate.
Out: PNG; two bars a slurry, the full DEM and the hybrid run with its parts, and how many times one fits in the other.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from slurrycast.figures import DEM, FAINT, INK, PREDICTED, RELAXED, new_figure, save_figure
from slurrycast.files import run_main
from slurrycast.speedup import HYBRID_PARTS, time_unit
from slurrycast.tables import read_table

PART_COLOURS = dict(zip(HYBRID_PARTS, ("#a9b8c6", PREDICTED, FAINT, RELAXED), strict=True))
AFTER = "#66788a"


def draw_costs(comparison: pd.DataFrame) -> Figure:
    """Draw the bars of one surrogate; rows of `comparison` as `speedup.compare_costs` returns them."""
    figure = new_figure(9.5, 1.2 + 0.62 * len(comparison))
    axes = figure.subplots()
    length, unit = time_unit(comparison[["dem", "hybrid"]].max(axis=None))
    places = np.arange(len(comparison))
    height = 0.36
    to_equilibrium = comparison.dem_to_equilibrium / length
    after = comparison.dem / length - to_equilibrium
    for width, left, colour, label in (
        (comparison.dem / length, 0.0, DEM, "full DEM"),
        (after, to_equilibrium, AFTER, "of it after equilibrium"),
    ):
        if width.notna().any():
            axes.barh(places - height / 2, width, height * 0.95, left=left, color=colour, label=label)
    start = np.zeros(len(comparison))
    for stage, label in HYBRID_PARTS.items():
        width = comparison[stage].to_numpy() / length
        axes.barh(places + height / 2, width, height * 0.95, left=start, color=PART_COLOURS[stage], label=label)
        start = start + width
    for place, row in enumerate(comparison.itertuples()):
        if not np.isnan(row.ratio):
            text = f"{row.ratio:.1f} ×"
            if not np.isnan(row.ratio_to_equilibrium):
                text += f"  ({row.ratio_to_equilibrium:.1f} × to equilibrium)"
            axes.annotate(
                text,
                (row.hybrid / length, place + height / 2),
                xytext=(5, 0),
                textcoords="offset points",
                va="center",
                fontsize=9,
                color=INK,
            )
    axes.set(yticks=places, yticklabels=comparison.slurry, ylabel="Slurry", xlabel=f"Wall time ({unit})")
    axes.invert_yaxis()
    axes.grid(axis="y", visible=False)
    figure.legend(loc="outside upper left", ncols=3, columnspacing=1.6, handlelength=1.2)
    return figure


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--speedup", type=Path, required=True, help="in: tables/speedup.csv")
    parser.add_argument("--surrogate", required=True, help="name of the surrogate in the table")
    parser.add_argument("--figure", type=Path, required=True, help="out: PNG")
    return parser.parse_args()


def main() -> None:
    """Read the table and draw the bars."""
    args = parse_args()
    table = read_table(args.speedup)
    wall = table[(table.surrogate == args.surrogate) & (table.clock == "wall_s")]
    save_figure(draw_costs(wall.reset_index(drop=True)), args.figure)


if __name__ == "__main__":
    run_main(main)
