"""Plot the learning curves of one surrogate (the reference article's Fig. 2): MSE and MAE on training and validation
particles.

In: history.csv with columns epoch, loss (MSE, um2), mae (um), val_loss, val_mae; without rows for a model that came
without learning curves.
Out: PNG with one panel for each measure, on a logarithmic scale.
"""

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import AutoLocator, LogLocator, MaxNLocator

from slurrycast.data.tables import read_table
from slurrycast.report.figures import TRAINING, VALIDATION, new_figure, note, plain_ticks, save_figure
from slurrycast.runtime.command_line import Namespace, Parser, run_main

MEASURES = (
    ("loss", "val_loss", "Mean squared error", "MSE (µm²)"),
    ("mae", "val_mae", "Mean absolute error", "MAE (µm)"),
)


def draw_learning_curves(history: pd.DataFrame) -> Figure:
    """Draw both measures against the epoch; the epoch with the lowest validation MSE is marked."""
    figure = new_figure(9, 3.6)
    for axes, (training, validation, title, label) in zip(figure.subplots(1, 2), MEASURES, strict=True):
        axes.set(title=title, xlabel="Epoch", ylabel=label)
        if history.empty:
            note(axes, "the model was trained elsewhere\nand came without learning curves")
            axes.set(xticks=[], yticks=[])
            continue
        marker = "o" if len(history) < 5 else None
        axes.semilogy(history.epoch, history[training], color=TRAINING, marker=marker, label="training")
        if history.val_loss.notna().any():  # else there was no validation slurry
            axes.semilogy(history.epoch, history[validation], color=VALIDATION, marker=marker, label="validation")
            best = history.loc[history.val_loss.idxmin()]
            label = f"{best[validation]:.3g} at epoch {best.epoch:.0f}, of the lowest MSE"
            axes.plot(best.epoch, best[validation], "o", color=VALIDATION, mec="white", ms=9, zorder=3, label=label)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        low, high = axes.get_ylim()
        plain_ticks(axes.yaxis, LogLocator(subs=(1, 2, 5)) if high > 10 * low else AutoLocator())
        axes.legend(loc="upper right", frameon=True, edgecolor="none")  # over a peak of the curves it stays readable
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--history", "history.csv of the surrogate")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the history and draw it."""
    save_figure(draw_learning_curves(read_table(args.history)), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
