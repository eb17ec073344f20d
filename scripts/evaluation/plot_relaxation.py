"""Plot how far relaxed structures are from the end of the DEM against how long they were relaxed.

In: tables/relaxation.csv.
Out: PNG, a panel each for density, RDF and coordination of all particles, in units of the noise of the DEM: of density
and coordination, standard deviations of DEM runs with other seeds; of the RDF, the mean difference between two of them.
A line is the mean of a surrogate over the slurries, bold where it starts from the recipe and not from the DEM; variants
and surrogates with earlier input frames are left out. The band is what counts as reached.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator

from slurrycast import surrogates
from slurrycast.data.tables import read_table
from slurrycast.evaluation.relaxation import BANDS, mean_errors
from slurrycast.report.figures import FAINT, SURROGATE_MARKERS, new_figure, plain_ticks, save_figure, surrogate_colours
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

PANELS = {
    "density_in_sd": ("Density", "|density − DEM| (replica sd)"),
    "rdf_in_spread": ("RDF, all particles", "mean |g − g of the DEM| (replica spreads)"),
    "coordination_in_sd": ("Coordination, all particles", "|contacts − DEM| (replica sd)"),
}
MARGIN = 1.3  # around the points


def draw_panel(axes: Axes, means: pd.DataFrame, band: float, colours: Mapping[str, str]) -> None:
    """Draw one panel; `means` are surrogates x steps, `band` the largest error that counts as reached."""
    known = means.to_numpy()
    known = known[np.isfinite(known) & (known > 0)]
    lowest, highest = min([band, *known]) / MARGIN, max([band, *known]) * MARGIN
    axes.axhspan(lowest, band, color=FAINT, alpha=0.5, linewidth=0, label="noise of the DEM: within the band")
    for (label, errors), marker in zip(means.iterrows(), SURROGATE_MARKERS * len(means), strict=False):
        bold = {"linewidth": 3.2, "zorder": 3} if surrogates.parse(label).surrogate.from_recipe else {}
        look = {"color": colours[label], "marker": marker, "ms": 7, "mec": "white", "mew": 0.6} | bold
        axes.plot(errors.index, errors, label=label, **look)
    axes.set(xscale="log", yscale="log", ylim=(lowest, highest), xlabel="Steps of the relaxation")
    axes.set_xlim(means.columns.min() / MARGIN, means.columns.max() * MARGIN)
    plain_ticks(axes.xaxis, FixedLocator(means.columns))
    plain_ticks(axes.yaxis, LogLocator(subs=(1, 2, 5)))


def draw_relaxation(table: pd.DataFrame) -> Figure:
    """Draw all panels; `table` is tables/relaxation.csv."""
    labels = surrogates.main_labels(list(dict.fromkeys(table.surrogate)))
    colours = surrogate_colours(labels)
    figure = new_figure(13.0, 5.0)
    panels = figure.subplots(1, len(PANELS))
    for axes, (column, (title, ylabel)) in zip(panels, PANELS.items(), strict=True):
        draw_panel(axes, mean_errors(table, column, labels), BANDS[column], colours)
        axes.set(title=f"{title} (band: {BANDS[column]:.3g})", ylabel=ylabel)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=5)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("relaxation")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the table and draw."""
    table = read_table(args.relaxation)
    if table.empty:
        raise InputError(f"{args.relaxation}: no relaxation in it")
    save_figure(draw_relaxation(table), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
