"""Draw what the fits of the properties are worth: each recipe's value against that expected from all others.

In: tables/explore_noise.csv and tables/explore_left_out.csv.
Out: PNG, a panel for each property. Bars are calibrated 90 % intervals, the band is twice the standard deviation of
replicas to either side.
"""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slurrycast.data.tables import read_table
from slurrycast.report.figures import FAINT, INK, RELAXED, new_figure, save_figure
from slurrycast.report.names import tape_quantity
from slurrycast.runtime.command_line import Namespace, Parser, run_main

COLUMNS = 3


def draw_fit(axes: Axes, points: pd.DataFrame, replica_sd: float, title: str) -> None:
    """Draw one property; `points` has its rows of the table."""
    both = points[["value", "expected"]].to_numpy()
    ends = np.array([both.min(), both.max()]) + np.array([-0.05, 0.05]) * (np.ptp(both) or 1.0)
    if replica_sd > 0:
        axes.fill_between(ends, ends - 2 * replica_sd, ends + 2 * replica_sd, color=FAINT, alpha=0.6, lw=0)
    axes.plot(ends, ends, color=INK, lw=0.9)
    style = {"fmt": "o", "ms": 3.5, "color": RELAXED, "ecolor": RELAXED, "elinewidth": 0.6, "alpha": 0.8}
    axes.errorbar(points.value, points.expected, points.half_width, **style)
    axes.set(xlim=ends, xlabel="computed", ylabel="expected from the others")
    axes.set_title(title, fontsize=9.5)


def draw_fits(left_out: pd.DataFrame, noise: pd.DataFrame) -> Figure:
    """Draw all properties that are fitted."""
    noise = noise[noise.property.isin(left_out.property)]
    rows = -(-len(noise) // COLUMNS)
    figure = new_figure(4.2 * COLUMNS, 3.3 * rows)
    panels = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for axes, row in zip(panels, noise.itertuples(), strict=False):
        title = tape_quantity(row.property, row.unit)
        draw_fit(axes, left_out[left_out.property == row.property], row.replica_sd, title)
    for axes in panels[len(noise) :]:
        axes.remove()
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("explore_noise", "explore_left_out")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the tables and draw."""
    noise = read_table(args.explore_noise).astype({"unit": str})
    save_figure(draw_fits(read_table(args.explore_left_out), noise), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
