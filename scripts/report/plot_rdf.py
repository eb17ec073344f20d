"""Plot the radial distribution functions (the reference article's Fig. 6): the DEM's and every surrogate's relaxed
structure.

In: curves of every surrogate and slurry (CSV), in any order, with columns surrogate, slurry, pair, r_um, g_dem,
g_relaxed (g_dem is empty for a slurry that the DEM did not run to the end), and tables/rdf_errors.csv (columns
surrogate, slurry, pair, mean_abs_difference).
Out: PNG with one panel for each slurry and pair.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from slurrycast.data.tables import read_table
from slurrycast.report.figures import DEM, INK, new_figure, save_figure, surrogate_colours
from slurrycast.runtime.command_line import Namespace, Parser, run_main

COLUMNS = 4
PAIR_LABELS = {"all": "all particles"}
DEM_STYLE = {"color": DEM, "lw": 3.2, "alpha": 0.45}  # a wide pale band, on which thin curves stay visible


def draw_rdf(
    curves: pd.DataFrame,
    slurries: Sequence[str],
    surrogates: Sequence[str],
    differences: Mapping[tuple[str, str, str], float],
) -> Figure:
    """Draw the curves of `slurries`, `COLUMNS` in a row, and under each slurry one panel for each pair.

    `differences` holds the mean absolute difference of target and relaxed curve by (surrogate, slurry, pair).
    """
    pairs = list(dict.fromkeys(curves.pair))
    colours = surrogate_colours(surrogates)
    columns = min(COLUMNS, len(slurries))
    blocks = -(-len(slurries) // columns)
    figure = new_figure(max(5.5, 3.0 * columns + 0.4), 2.3 * blocks * len(pairs) + 0.6)
    grid = figure.subplots(blocks * len(pairs), columns, squeeze=False, sharex=True)
    for axes in grid.flat:
        axes.set_visible(False)
    highest = {
        pair: 1.25 * np.nanmax(of_pair[["g_dem", "g_relaxed"]]) for pair, of_pair in curves.groupby("pair", sort=False)
    }
    for place, slurry in enumerate(slurries):
        block, column = divmod(place, columns)
        of_slurry = curves[curves.slurry == slurry]
        for row, pair in enumerate(pairs):
            axes = grid[block * len(pairs) + row, column]
            axes.set_visible(True)
            of_pair = of_slurry[of_slurry.pair == pair]
            axes.axhline(1, color="#aab3bb", lw=0.7, zorder=1)
            target = of_pair[of_pair.surrogate == surrogates[0]]
            axes.plot(target.r_um, target.g_dem, **DEM_STYLE)
            lines = [("not in its recipe" if of_pair.empty else f"r < {target.r_um.max():.1f} µm", INK)]
            known = [name for name in surrogates if (name, slurry, pair) in differences]
            lines += [("mean |Δg| × 10³", INK)] if known else []
            lines += [(f"{1000 * differences[name, slurry, pair]:.1f}", colours[name]) for name in known]
            for name in surrogates:
                curve = of_pair[of_pair.surrogate == name]
                axes.plot(curve.r_um, curve.g_relaxed, color=colours[name], lw=1.1)
            for place_of_line, (text, colour) in enumerate(lines):
                position = {"xytext": (0, -11 * place_of_line), "textcoords": "offset points"}
                style = {"xycoords": "axes fraction", "ha": "right", "va": "top", "fontsize": 8.5, "color": colour}
                axes.annotate(text, (0.98, 0.98), **position, **style)
            axes.set(xlim=(0, curves.r_um.max()), ylim=(0, highest[pair]))
            if row == 0:
                axes.set_title(f"Slurry {slurry}")
            if column == 0:
                axes.set_ylabel(f"g(r)\n{PAIR_LABELS.get(pair, pair)}")
            last_in_column = place + columns >= len(slurries) and row == len(pairs) - 1
            axes.tick_params(labelbottom=last_in_column, labelleft=column == 0)
            if last_in_column:
                axes.set_xlabel("r (µm)")
    handles = [Line2D([], [], **DEM_STYLE, label="target (DEM)")] if curves.g_dem.notna().any() else []
    handles += [Line2D([], [], color=colour, lw=1.6, label=f"{name}, relaxed") for name, colour in colours.items()]
    figure.legend(handles=handles, loc="outside upper center", ncols=min(len(handles), columns + 1), fontsize=10)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--surrogates", "labels, in the order of drawing", nargs="+")
    parser.add_value("--slurries", "ids, in the order of drawing", nargs="+")
    parser.add_input("--rdf", "curves (CSV, r in um), in any order", nargs="+")
    parser.add_tables("rdf_errors")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the curves and draw them."""
    curves = pd.concat(map(read_table, args.rdf))
    errors = read_table(args.rdf_errors)
    differences = {(row.surrogate, row.slurry, row.pair): row.mean_abs_difference for row in errors.itertuples()}
    save_figure(draw_rdf(curves, args.slurries, args.surrogates, differences), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
