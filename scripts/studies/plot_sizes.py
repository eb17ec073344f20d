"""Plot the error of the predicted volume against the size of a slurry, one panel for each run, to tell causes apart.

In: tables/size_errors.csv of one run or several, such as one with the same damping time for all sizes and one with
damping times that let all sizes shrink at the same rate.
Out: PNG; a point is one slurry, its marker tells the thickness ratio, and a line joins the means of each surrogate. The
points of a size stand side by side. The dashed line is the final volume of slurry 6 in the
reference article.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator

from slurrycast.data.tables import read_table
from slurrycast.report import reference_article as article
from slurrycast.report.figures import ARTICLE, INK, new_figure, plain_ticks, save_figure, surrogate_colours
from slurrycast.runtime.command_line import Namespace, Parser, named_file, run_main
from slurrycast.runtime.files import InputError

MARKERS = "osD^vP*X"
SPREAD = 0.06  # the points of a size are spread over this share of its number of particles to both sides
ARTICLE_ERROR = article.HYBRID_STRUCTURE["6"].volume_um3 / article.DEM_STRUCTURE["6"].volume_um3 - 1
ARTICLE_LABEL = f"reference article, slurry 6: {100 * ARTICLE_ERROR:+.0f} %".replace("-", "−")


def draw_panel(axes: Axes, errors: pd.DataFrame, colours: Mapping[str, str], markers: Mapping[float, str]) -> None:
    """Draw one run; `errors` are rows of tables/size_errors.csv."""
    axes.axhline(0, color=INK, linewidth=0.8, zorder=1)
    axes.axhline(100 * ARTICLE_ERROR, color=ARTICLE, linestyle="--", linewidth=1.2, zorder=1)
    aside = np.linspace(1 - SPREAD, 1 + SPREAD, len(colours)) if len(colours) > 1 else [1.0]
    for (label, colour), factor in zip(colours.items(), aside, strict=True):
        rows = errors[errors.surrogate == label]
        means = rows.groupby("particles").predicted_volume_error.mean()
        axes.plot(factor * means.index, 100 * means, color=colour, linewidth=1.0, zorder=1.5)
        for ratio, marker in markers.items():
            points = rows[rows.thickness_ratio == ratio]
            x, y = factor * points.particles, 100 * points.predicted_volume_error
            axes.plot(x, y, marker, color=colour, markeredgecolor="white", markeredgewidth=0.6, ms=8)
    sizes = np.unique(errors.particles)
    axes.set(xscale="log", xlabel="Particles", xlim=(sizes[0] / 1.3, sizes[-1] * 1.3))
    plain_ticks(axes.xaxis, FixedLocator(sizes))


def draw_sizes(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Draw all panels; `tables` are those of size_errors.csv by the name of their run."""
    together = pd.concat(tables.values())
    colours = surrogate_colours(list(dict.fromkeys(together.surrogate)))
    markers = dict(zip(np.unique(together.thickness_ratio), MARKERS * len(together), strict=False))
    figure = new_figure(max(6.5, 1.5 + 4.5 * len(tables)), 5.0)
    panels: Sequence[Axes] = figure.subplots(1, len(tables), sharey=True, squeeze=False)[0]
    for axes, (name, errors) in zip(panels, tables.items(), strict=True):
        draw_panel(axes, errors, colours, markers)
        axes.set_title(name)
    panels[0].set_ylabel("Predicted volume / DEM − 1, before relaxation (%)")
    legend = [Line2D([], [], color=colour, marker="o", ms=7, label=label) for label, colour in colours.items()]
    for ratio, marker in markers.items():
        legend.append(Line2D([], [], color=INK, marker=marker, ls="", ms=7, label=f"thickness ratio {ratio:g}"))
    legend.append(Line2D([], [], color=ARTICLE, linestyle="--", label=ARTICLE_LABEL))
    figure.legend(handles=legend, loc="outside right center")
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    content = "tables/size_errors.csv of each run, with the name that its panel gets"
    parser.add_input("--tables", content, nargs="+", type=named_file, metavar="NAME=PATH")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the tables and draw."""
    tables = {name: read_table(path) for name, path in args.tables}
    if len(tables) < len(args.tables):
        raise InputError(f"--tables: the names {', '.join(name for name, _ in args.tables)} must differ")
    save_figure(draw_sizes(tables), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
