"""Plot what the spreads of predictions are worth: how many errors they cover, and whether large ones mean large errors.

In: pairs of frame stores (HDF5): a predicted structure with a spread, and the DEM frames of the same slurry with the
target frame; tables/uncertainty.csv for roles and calibrated coverage.
Out: PNG with one row for each surrogate. Left: coverage against the nominal level. Lines, one for each slurry, take the
spread as the standard deviation of a normal error; dots are the calibrated intervals. Right: root mean square error
against spread, in bins of equally many coordinates; numbers name the slurries. Dashed diagonals: what is expected.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slurrycast.data.tables import read_table
from slurrycast.evaluation.uncertainty import Judged, binned_um, expected_coverage, read_judged
from slurrycast.report.figures import INK, RELAXED, VALIDATION, new_figure, save_figure
from slurrycast.runtime.command_line import Namespace, Parser, run_main

CURVE_LEVELS = np.linspace(0.02, 0.98, 49)
BINS = 10
LINE = 0.032  # height of a name, as a share of the panel
ROLES = {"test": (RELAXED, "o", "test slurry"), "validation": (VALIDATION, "s", "validation slurry, calibrated on")}
DIAGONAL = {"color": INK, "linestyle": "--", "linewidth": 1.0, "zorder": 1}


def draw_reliability(axes: Axes, judged: Sequence[Judged], table: pd.DataFrame) -> None:
    """Draw coverage against the nominal level, both in %; `table` has the rows of one surrogate."""
    roles = dict(zip(table.slurry, table.role, strict=True))
    axes.plot([0, 100], [0, 100], **DIAGONAL)
    for one in judged:
        colour, _, _ = ROLES[roles[one.slurry]]
        axes.plot(100 * CURVE_LEVELS, 100 * expected_coverage(one.scores, CURVE_LEVELS), color=colour, linewidth=1.0)
    for row in table.itertuples():
        colour, marker, _ = ROLES[row.role]
        axes.plot(100 * row.level, 100 * row.coverage, marker, color=colour, ms=6, markeredgecolor="white", zorder=3)
    axes.set(xlabel="Nominal level (%)", ylabel="Errors within the interval (%)", xlim=(0, 100), ylim=(0, 100))
    axes.set_aspect("equal")


def spaced(places: Sequence[float], least: float) -> np.ndarray:
    """Rising `places`, moved so that neighbours are `least` apart: the mean of moving them up only and down only."""
    steps = least * np.arange(len(places))
    up = np.maximum.accumulate(np.asarray(places) - steps) + steps
    down = np.minimum.accumulate((np.asarray(places) - steps)[::-1])[::-1] + steps
    return (up + down) / 2


def draw_bins(axes: Axes, judged: Sequence[Judged], table: pd.DataFrame) -> None:
    """Draw rms error against spread, both in um; `table` has the rows of one surrogate."""
    roles = dict(zip(table.slurry, table.role, strict=True))
    highest, ends = 0.0, []
    for one in judged:
        colour, marker, _ = ROLES[roles[one.slurry]]
        spread_um, error_um = binned_um(one.spread_um, one.error_um, BINS)
        axes.plot(spread_um, error_um, f"{marker}-", color=colour, ms=4, linewidth=1.0)
        ends.append((error_um[-1], spread_um[-1], one.slurry))
        highest = max(highest, spread_um.max(), error_um.max())
    limits = (0, 1.08 * highest)
    ends.sort()
    places_um = spaced([error_um for error_um, _, _ in ends], LINE * highest)
    for (_, spread_um, slurry), place_um in zip(ends, places_um, strict=True):
        axes.annotate(slurry, (spread_um, place_um), (6, 0), textcoords="offset points", fontsize=8, va="center")
    axes.plot(limits, limits, **DIAGONAL)
    axes.set(xlabel="Spread (µm)", ylabel="Root mean square error (µm)", xlim=limits, ylim=limits)
    axes.set_aspect("equal")


def draw_uncertainty(judged: Sequence[Judged], table: pd.DataFrame) -> Figure:
    """Draw both panels for every surrogate of `table` (tables/uncertainty.csv)."""
    surrogates = list(dict.fromkeys(table.surrogate))
    figure = new_figure(9.5, 0.6 + 4.4 * len(surrogates))
    panels = figure.subplots(len(surrogates), 2, squeeze=False)
    for (reliability, bins), surrogate in zip(panels, surrogates, strict=True):
        slurries = [one for one in judged if one.surrogate == surrogate]
        rows = table[table.surrogate == surrogate]
        draw_reliability(reliability, slurries, rows)
        draw_bins(bins, slurries, rows)
        reliability.set_title(f"{surrogate}: coverage")
        bins.set_title(f"{surrogate}: error against spread")
    for role in dict.fromkeys(table.role):
        colour, marker, words = ROLES[role]
        panels[0, 0].plot([], [], f"{marker}-", color=colour, ms=6, label=words)
    panels[0, 0].plot([], [], "-", color=INK, linewidth=1.0, label="coverage of the spread as it comes")
    panels[0, 0].plot([], [], "o", color=INK, ms=6, label="calibrated coverage")
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_predictions(required=True)
    parser.add_tables("uncertainty")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read everything and draw it."""
    judged = read_judged(args.predicted, args.frames, args.target_frame)
    save_figure(draw_uncertainty(judged, read_table(args.uncertainty)), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
