"""Plot what a surrogate is worth on a recipe against the number of its slurries that it was trained on.

In: tables/tuning.csv.
Out: PNG, a panel for each surrogate: the mean skill over the predicted slurries, with its least and greatest value, of
fine-tuned models and of those trained from scratch. 0 is the affine map, 1 as near as one perturbed run.
"""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

from slurrycast.data.tables import read_table
from slurrycast.report.figures import INK, PREDICTED, RELAXED, new_figure, save_figure
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

STARTS = {"fine_tuned": ("fine-tuned", RELAXED, "o-"), "from_scratch": ("trained from scratch", PREDICTED, "s--")}
APART = 0.04  # slurries between the two starts, so that no bar hides another


def draw_panel(axes: Axes, rows: pd.DataFrame) -> None:
    """Draw the trainings of one surrogate."""
    axes.axhline(0, color=INK, linewidth=0.8)
    for shift, (start, (name, colour, style)) in zip((-APART, APART), STARTS.items(), strict=True):
        of_start = rows[rows.start == start].sort_values("slurries")
        reach = [of_start.skill - of_start.least_skill, of_start.greatest_skill - of_start.skill]
        look = {"color": colour, "label": name, "ms": 6.5, "capsize": 3}
        axes.errorbar(of_start.slurries + shift, of_start.skill, reach, fmt=style, **look)
    axes.xaxis.set_major_locator(FixedLocator(sorted(set(rows.slurries))))


def draw_tuning(tuning: pd.DataFrame) -> Figure:
    """Draw all panels; `tuning` is tables/tuning.csv."""
    figure = new_figure(4.6 * tuning.surrogate.nunique() + 0.4, 4.2)
    panels = figure.subplots(1, tuning.surrogate.nunique(), squeeze=False)[0]
    for axes, (label, rows) in zip(panels, tuning.groupby("surrogate", sort=False), strict=True):
        draw_panel(axes, rows)
        axes.set(title=label, xlabel="Slurries of the recipe to train on", ylabel="Skill (0: affine map)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("tuning")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the table and draw."""
    tuning = read_table(args.tuning).dropna(subset=["skill"])
    if tuning.empty:
        raise InputError(f"{args.tuning}: no skill in it")
    save_figure(draw_tuning(tuning), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
