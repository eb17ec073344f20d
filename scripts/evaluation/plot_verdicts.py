"""Plot how far each surrogate's relaxed structures, or its tapes, are from the DEM's in each measure, and the verdicts.

In: tables/verdicts.csv or tables/tape_verdicts.csv.
Out: PNG with one row for each surrogate and one column for each measure. The colour of a cell is the mean difference
in replica sd. A triangle, up for too high and down for too low, marks what differs, a question mark what is not
resolved, and a dash what has no verdict; a cell without a mark is equivalent to the DEM.
"""

from itertools import pairwise

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import SymLogNorm
from matplotlib.figure import Figure

from slurrycast.data.tables import read_table
from slurrycast.evaluation.noise import BAND_SDS
from slurrycast.evaluation.verdicts import DIFFERS, EQUIVALENT, MEASURES, NOT_RESOLVED, TAPE_MEASURES, group_of
from slurrycast.report.figures import INK, new_figure, note, save_figure
from slurrycast.report.names import measure_name
from slurrycast.runtime.command_line import Namespace, Parser, run_main

HIGHEST = 30.0  # colours do not tell beyond
COLOURS = "PuOr_r"  # both ends are dark, and they differ for the colour-blind too
DARK_FROM = 0.3  # distance from the middle of the colours from which marks are white
LEGEND = "no mark: equivalent     ▲ ▼ differs, too high or too low     ? not resolved     – not judged"
CELL_IN, LETTER_IN = 0.3, 0.07


def mark(mean_in_sd: float, verdict: str) -> str:
    """Mark of a cell."""
    if verdict == DIFFERS:
        return "▲" if mean_in_sd > 0 else "▼"
    return {EQUIVALENT: "", NOT_RESOLVED: "?"}.get(verdict, "–")


def draw_cells(axes: Axes, table: pd.DataFrame, measures: list[str], surrogates: list[str]) -> None:
    """Draw the cells with their marks; `table` has a row for each surrogate and measure."""
    by_cell = table.set_index(["surrogate", "measure"])[["mean_in_sd", "verdict"]].unstack().reindex(surrogates)
    means, verdicts = by_cell.mean_in_sd[measures].astype(float), by_cell.verdict[measures]
    norm = SymLogNorm(BAND_SDS, vmin=-HIGHEST, vmax=HIGHEST, clip=True)
    image = axes.imshow(means.to_numpy(), norm=norm, cmap=COLOURS, aspect="auto")
    bar = axes.figure.colorbar(image, ax=axes, ticks=[-30, -10, -2, 0, 2, 10, 30], format="{x:g}", pad=0.01, aspect=15)
    bar.set_label("mean difference (replica sd)")
    bar.ax.minorticks_off()
    for (row, column), mean in np.ndenumerate(means.to_numpy()):
        dark = not np.isnan(mean) and abs(norm(mean) - 0.5) > DARK_FROM
        text = mark(mean, verdicts.iat[row, column])
        axes.text(column, row, text, ha="center", va="center", fontsize=9, color="white" if dark else INK)


def draw_verdicts(table: pd.DataFrame) -> Figure:
    """Draw tables/verdicts.csv or tables/tape_verdicts.csv."""
    groups, surrogates = list(MEASURES | TAPE_MEASURES), list(dict.fromkeys(table.surrogate))
    measures = sorted(dict.fromkeys(table.measure), key=lambda measure: groups.index(group_of(measure)))
    longest = max(map(len, map(measure_name, measures)), default=0)
    height_in = 1.0 + LETTER_IN * longest + CELL_IN * 0.85 * max(len(surrogates), 3)
    figure = new_figure(3.0 + CELL_IN * max(len(measures), 12), height_in)
    axes = figure.subplots()
    if measures:
        draw_cells(axes, table, measures, surrogates)
        for place, (measure, following) in enumerate(pairwise(measures)):
            if group_of(measure) != group_of(following):
                axes.axvline(place + 0.5, color="white", linewidth=4)
        axes.set_xlabel(LEGEND, fontsize=9, labelpad=8)
    else:
        note(axes, "no slurry to judge on")
    axes.set_xticks(range(len(measures)), map(measure_name, measures), rotation=90)
    axes.set_yticks(range(len(surrogates)), surrogates)
    axes.tick_params(top=True, labeltop=True, bottom=False, labelbottom=False, length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("verdicts")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the table and draw it."""
    save_figure(draw_verdicts(read_table(args.verdicts)), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
