"""Plot how far each surrogate's relaxed structure is from the DEM's, in units of the scatter between DEM runs.

In: tables/structure_errors.csv (columns surrogate, slurry, stage, quantity, value, dem_value, replica_sd).
Out: PNG with one row for each quantity and one column for each surrogate: the mean over the slurries of
|value - dem_value| / replica_sd. Two DEM runs with other seeds differ by about 1.
"""

import numpy as np
import pandas as pd
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure

from slurrycast.data.tables import read_table
from slurrycast.evaluation.verdicts import deviations
from slurrycast.report.figures import INK, RELAXED, new_figure, note, save_figure
from slurrycast.report.names import quantity_name
from slurrycast.runtime.command_line import Namespace, Parser, run_main

# From what noise alone gives to what is plainly off; colours do not tell beyond.
LOWEST, HIGHEST = 1.0, 30.0
COLOURS = LinearSegmentedColormap.from_list("deviation", ["#ffffff", "#9fd0cd", RELAXED, "#0b3c49"])


def draw_structure(mean_in_sd: pd.DataFrame) -> Figure:
    """Draw `mean_in_sd` (quantities x surrogates); NaN, where the scatter is not known, stays empty."""
    rows, columns = mean_in_sd.shape
    figure = new_figure(2.6 + 0.62 * max(columns, 5), 1.7 + 0.3 * rows)
    axes = figure.subplots()
    if mean_in_sd.notna().to_numpy().any():
        norm = LogNorm(LOWEST, HIGHEST, clip=True)
        image = axes.imshow(mean_in_sd, norm=norm, cmap=COLOURS, aspect="auto")
        bar = figure.colorbar(
            image, ax=axes, ticks=[1, 2, 5, 10, 30], format="{x:g}", shrink=0.7, pad=0.02, extend="both"
        )
        bar.set_label("mean deviation (replica sd)")
        bar.ax.minorticks_off()
        for (row, column), value in np.ndenumerate(mean_in_sd.to_numpy()):
            if not np.isnan(value):
                colour = "white" if norm(value) > 0.55 else INK
                text = f"{value:.1f}" if value < 99.5 else f"{value:.0f}"
                axes.text(column, row, text, ha="center", va="center", fontsize=8, color=colour)
    else:
        note(axes, "no replicas: the scatter of the DEM is not known")
    axes.set_xticks(range(columns), mean_in_sd.columns, rotation=40, ha="left", rotation_mode="anchor")
    axes.set_yticks(range(rows), [quantity_name(quantity) for quantity in mean_in_sd.index])
    axes.tick_params(top=True, labeltop=True, bottom=False, labelbottom=False, length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("structure_errors")
    parser.add_value("--slurries", "slurries that means run over", nargs="+")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the table and draw it."""
    table = deviations(read_table(args.structure_errors))
    shown = table[(table.stage == "relaxed") & table.slurry.isin(args.slurries)]
    means = shown.pivot_table(index="quantity", columns="surrogate", values="in_sd", sort=False, dropna=False)
    order = list(dict.fromkeys(shown.surrogate))
    save_figure(draw_structure(means.reindex(list(dict.fromkeys(shown.quantity)))[order]), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
