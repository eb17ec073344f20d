"""Plot the learning curves of one surrogate (the reference article's Fig. 2): MSE and MAE on training and validation
particles.

In: history.csv with columns epoch, loss (MSE, um2), mae (um), val_loss, val_mae, and perhaps those of held-out
slurries; without rows for a model that came without learning curves. Where held-out slurries are shown, the errors of
predicted coordinates (CSV), for what `affine` and `linear` reach on the test slurries.
Out: PNG with one panel for each measure, on a logarithmic scale.
"""

from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import AutoLocator, LogLocator, MaxNLocator

from slurrycast.data.tables import read_table
from slurrycast.report.figures import HELD_OUT, TRAINING, VALIDATION, new_figure, note, plain_ticks, save_figure
from slurrycast.runtime.command_line import Namespace, Parser, run_main

MEASURES = (
    ("loss", "mse_um2", "Mean squared error", "MSE (µm²)"),
    ("mae", "mae_um", "Mean absolute error", "MAE (µm)"),
)
FITS = {"affine": "--", "linear": ":"}  # without a network, and their line styles


def reached_by_fits(errors: pd.DataFrame, slurries: Sequence[str]) -> pd.DataFrame:
    """Means over the test slurries of a table of coordinate errors: mse_um2 and mae_um of each of FITS in it."""
    wanted = (errors.axis == "all") & errors.slurry.isin(slurries) & errors.surrogate.isin(FITS)
    return errors[wanted].groupby("surrogate")[["mse_um2", "mae_um"]].mean()


def draw_held_out(axes: Axes, history: pd.DataFrame, measure: str, column: str, reached: pd.DataFrame) -> None:
    """Draw the errors of held-out slurries, where they were measured, and what the fits reach on the test slurries."""
    axes.set_xscale("log")
    plain_ticks(axes.xaxis, LogLocator(subs=(1, 2, 5)))
    for role, colour in HELD_OUT.items():
        name = f"{role}_slurries_{measure}"
        if name in history:
            known = history[history[name].notna()]
            axes.plot(known.epoch, known[name], ".-", color=colour, lw=1, label=f"{role} slurries")
    for label, value in reached[column].items():
        axes.axhline(value, color=HELD_OUT["test"], ls=FITS[label], lw=1.2, label=f"{label}, test slurries")


def draw_learning_curves(history: pd.DataFrame, reached: pd.DataFrame | None = None) -> Figure:
    """Draw both measures against the epoch; the epoch with the lowest validation MSE is marked.

    `reached` (see `reached_by_fits`) is there if the history has errors of held-out slurries.
    """
    figure = new_figure(9, 3.6 if reached is None else 4.6)
    for axes, (training, column, title, label) in zip(figure.subplots(1, 2), MEASURES, strict=True):
        validation = f"val_{training}"
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
        if reached is None:
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        else:
            draw_held_out(axes, history, training, column, reached)
        low, high = axes.get_ylim()
        plain_ticks(axes.yaxis, LogLocator(subs=(1, 2, 5)) if high > 10 * low else AutoLocator())
        axes.legend(loc="upper right", frameon=True, edgecolor="none")  # over a peak of the curves it stays readable
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--history", "history.csv of the surrogate")
    parser.add_input(
        "--coordinate-errors", "tables/coordinate_errors.csv, if held-out slurries are shown", required=False
    )
    parser.add_value("--test", "ids of the test slurries in it", nargs="*", default=[])
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the history and draw it."""
    reached = reached_by_fits(read_table(args.coordinate_errors), args.test) if args.coordinate_errors else None
    save_figure(draw_learning_curves(read_table(args.history), reached), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
