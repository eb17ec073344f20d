"""Plot the skill of every surrogate on each slurry: 0 is the affine map, 1 as near as one perturbed run.

In: tables/skill.csv; slurries without a floor have no skill and are left out.
Out: PNG with one row for each surrogate: one numbered dot for each slurry and a bar at their median. Skills below the
axis stand at its left edge with their value.
"""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from slurrycast.data.tables import read_table
from slurrycast.report.figures import FAINT, INK, new_figure, save_figure, surrogate_colours
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

MEDIAN = "#b9c2ca"
LOWEST = -1.0  # left end of the axis at most
SLOT_IN = 0.1  # height of a slurry within the row of a surrogate


def draw_skill(skill: pd.DataFrame) -> Figure:
    """Draw the dots; rows of tables/skill.csv with a skill."""
    labels, slurries = list(dict.fromkeys(skill.surrogate)), list(dict.fromkeys(skill.slurry))
    figure = new_figure(8.5, 1.0 + len(labels) * max(0.3, SLOT_IN * (len(slurries) + 1)))
    axes = figure.subplots()
    left = max(LOWEST, min(skill.skill.min(), 0.0) - 0.1)
    step = 1 / (len(slurries) + 1)
    for row, (label, colour) in enumerate(surrogate_colours(labels).items()):
        points = skill[skill.surrogate == label]
        median = points.skill.median()
        if median >= left:
            axes.plot([median, median], [row - 0.42, row + 0.42], color=MEDIAN, linewidth=3.0, zorder=1.5)
        for point in points.itertuples():
            place = row - 0.5 + step * (slurries.index(point.slurry) + 1)
            below = point.skill < left
            x = left if below else point.skill
            axes.plot(x, place, "<" if below else "o", color=colour, ms=6.5, markeredgecolor="none", clip_on=False)
            text = f"{point.slurry}: −{-point.skill:.1f}" if below else point.slurry
            axes.annotate(text, (x, place), xytext=(6, 0), textcoords="offset points", fontsize=7, va="center_baseline")
    for x, name in ((0, "affine map"), (1, "perturbed run")):
        axes.axvline(x, color=INK, linestyle="--", linewidth=1.0, zorder=1)
        axes.annotate(name, (x, 1), (0, 4), ("data", "axes fraction"), "offset points", ha="center", fontsize=9)
    axes.hlines(np.arange(len(labels) - 1) + 0.5, 0, 1, FAINT, linewidth=0.7, transform=axes.get_yaxis_transform())
    axes.set(yticks=range(len(labels)), yticklabels=labels, ylim=(len(labels) - 0.5, -0.5), xlabel="Skill")
    axes.set_xlim(left, max(1.05, skill.skill.max() + 0.05))
    axes.grid(axis="y", visible=False)
    axes.tick_params(axis="y", length=0, pad=9)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("skill")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the table and draw the dots."""
    skill = read_table(args.skill).dropna(subset=["skill"])
    if skill.empty:
        raise InputError(f"{args.skill}: no skill in it")
    save_figure(draw_skill(skill), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
