"""Plot the radial distribution functions (the study's Fig. 6): target against predicted and relaxed structures.

In: for each slurry, in the order of --slurries, its curves (CSV) with columns pair, r_um, g_dem, g_predicted, g_relaxed
(g_dem is empty for a slurry that the DEM did not run to the end), and tables/rdf_errors.csv (columns surrogate, slurry,
pair, mean_abs_difference).
Out: PNG with one panel for each slurry and pair.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from slurrycast.figures import DEM, PREDICTED, RELAXED, new_figure, save_figure
from slurrycast.files import run_main
from slurrycast.tables import read_table

COLUMNS = 4
CURVES = (
    ("g_predicted", "predicted, before relaxation", {"color": PREDICTED, "lw": 1.1}),
    ("g_dem", "target (DEM)", {"color": DEM, "lw": 2.0}),
    ("g_relaxed", "relaxed (hybrid)", {"color": RELAXED, "lw": 1.4, "ls": (0, (4, 1.2))}),
)
PAIR_LABELS = {"all": "all particles"}


def draw_rdf(rdf: Mapping[str, pd.DataFrame], differences: Mapping[tuple[str, str], float]) -> Figure:
    """Draw the curves of each slurry in `rdf`, one row of panels a pair.

    `differences` holds the mean absolute difference of target and relaxed curve by (slurry, pair).
    """
    slurries = list(rdf)
    pairs = list(dict.fromkeys(pd.concat(rdf.values()).pair))
    columns = min(COLUMNS, len(slurries))
    blocks = -(-len(slurries) // columns)
    figure = new_figure(max(5.5, 2.9 * columns + 0.4), 2.1 * blocks * len(pairs) + 0.6)
    grid = figure.subplots(blocks * len(pairs), columns, squeeze=False, sharex=True)
    for axes in grid.flat:
        axes.set_visible(False)
    # Overlapping particles can give the predicted curve spikes near r = 0: it may leave the panel, the others do not.
    highest = {
        pair: 1.12 * max(np.nanmax(curves.loc[curves.pair == pair, ["g_dem", "g_relaxed"]]) for curves in rdf.values())
        for pair in pairs
    }
    farthest_um = max(curves.r_um.max() for curves in rdf.values())
    for place, (slurry, curves) in enumerate(rdf.items()):
        block, column = divmod(place, columns)
        for row, pair in enumerate(pairs):
            axes = grid[block * len(pairs) + row, column]
            axes.set_visible(True)
            of_pair = curves[curves.pair == pair]
            axes.axhline(1, color="#aab3bb", lw=0.7, zorder=1)
            for name, _, style in CURVES:
                axes.plot(of_pair.r_um, of_pair[name], **style)
            text = f"r < {of_pair.r_um.max():.1f} µm"
            if (slurry, pair) in differences:
                text = f"mean |Δg| {differences[slurry, pair]:.3f}\n{text}"
            axes.text(0.97, 0.95, text, transform=axes.transAxes, ha="right", va="top", fontsize=8.5)
            axes.set_xlim(0, farthest_um)
            axes.set_ylim(0, highest[pair])
            if row == 0:
                axes.set_title(f"Slurry {slurry}")
            if column == 0:
                axes.set_ylabel(f"g(r)\n{PAIR_LABELS.get(pair, pair)}")
            last_in_column = place + columns >= len(slurries) and row == len(pairs) - 1
            axes.tick_params(labelbottom=last_in_column, labelleft=column == 0)
            if last_in_column:
                axes.set_xlabel("r (µm)")
    figure.legend(
        handles=[
            Line2D([], [], **style, label=label)
            for name, label, style in CURVES
            if any(curves[name].notna().any() for curves in rdf.values())
        ],
        loc="outside upper center",
        ncols=len(CURVES),
        fontsize=10,
    )
    return figure


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--slurries", nargs="+", required=True, help="ids, in the order of --rdf")
    parser.add_argument("--rdf", nargs="+", type=Path, required=True, help="in: curves of each slurry (CSV, r in um)")
    parser.add_argument("--rdf-errors", type=Path, required=True, help="in: tables/rdf_errors.csv")
    parser.add_argument("--surrogate", required=True, help="name of the surrogate in the table")
    parser.add_argument("--figure", type=Path, required=True, help="out: PNG")
    return parser.parse_args()


def main() -> None:
    """Read the curves and draw them."""
    args = parse_args()
    rdf = {slurry: read_table(path) for slurry, path in zip(args.slurries, args.rdf, strict=True)}
    errors = read_table(args.rdf_errors)
    errors = errors[errors.surrogate == args.surrogate]
    differences = {(row.slurry, row.pair): row.mean_abs_difference for row in errors.itertuples()}
    save_figure(draw_rdf(rdf, differences), args.figure)


if __name__ == "__main__":
    run_main(main)
