"""Plot the learning curves of one surrogate (the reference article's Fig. 2): MSE and MAE on training and validation
particles.

In: history.csv with columns epoch, loss (MSE, um2), mae (um), val_loss, val_mae, and perhaps those of held-out
slurries; without rows for a model that came without learning curves. For comparison, a model of the folder `linear` or
`linear_box` (JSON), with what it and the affine map reach on the same particles, and, where held-out slurries are
shown, the errors of predicted coordinates (CSV), with what both reach on the test slurries.
Out: PNG with one panel for each measure, on a logarithmic scale.
"""

import json
from collections.abc import Mapping, Sequence

import numpy as np
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
MAPS = {"affine": "--", "linear": ":", "linear_box": ":"}  # without a network, and their line styles
COLOURS = {"training": TRAINING, "validation": VALIDATION, "test": HELD_OUT["test"]}
LONG = 30  # epochs of a training whose first ones are cut off


def reached_on_particles(model: Mapping, name: str) -> pd.DataFrame:
    """What the affine map and a fit reach on the particles of the training slurries, from the model of the fit.

    Columns are surrogate, where (training or validation), mse_um2 and mae_um; `name` is that of the fit.
    """
    rows = [
        {"surrogate": surrogate, "where": part, **{of: model[f"{prefix}{part}_{of}"] for of in ("mse_um2", "mae_um")}}
        for surrogate, prefix in (("affine", "affine_"), (name, ""))
        for part in ("training", "validation")
    ]
    return pd.DataFrame(rows)


def reached_on_slurries(errors: pd.DataFrame, slurries: Sequence[str]) -> pd.DataFrame:
    """The same of the test slurries (where is test): means over them, from a table of coordinate errors."""
    wanted = (errors.axis == "all") & errors.slurry.isin(slurries) & errors.surrogate.isin(MAPS)
    means = errors[wanted].groupby("surrogate")[["mse_um2", "mae_um"]].mean()
    return means.reset_index().assign(where="test")


def draw_held_out(axes: Axes, history: pd.DataFrame, measure: str) -> None:
    """Draw the errors of held-out slurries, where they were measured."""
    for role, colour in HELD_OUT.items():
        name = f"{role}_slurries_{measure}"
        if name in history:
            known = history[history[name].notna()]
            axes.plot(known.epoch, known[name], ".-", color=colour, lw=1, label=f"{role} slurries")


def draw_reached(axes: Axes, reached: pd.DataFrame, column: str) -> None:
    """Draw lines at what other surrogates reach, in the colour of where they do, and an entry a surrogate."""
    for surrogate, where, value in zip(reached.surrogate, reached["where"], reached[column], strict=True):
        axes.axhline(value, color=COLOURS[where], ls=MAPS[surrogate], lw=1.2)
    for surrogate in reached.surrogate.unique():
        axes.plot([], [], color="0.3", ls=MAPS[surrogate], lw=1.2, label=f"{surrogate}, in the same colours")


def highest_after_start(history: pd.DataFrame, measure: str) -> float:
    """The largest error after the first tenth of the epochs, which are so much worse that they hide all others."""
    settled = history[history.epoch > len(history) / 10]
    return float(np.nanmax(settled[[measure, f"val_{measure}"]]))


def draw_learning_curves(history: pd.DataFrame, reached: pd.DataFrame | None = None) -> Figure:
    """Draw both measures against the epoch; the epoch with the lowest validation MSE is marked.

    `reached` is what other surrogates reach, if it is known (see `reached_on_particles`).
    """
    held_out = any("_slurries_" in name for name in history)
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
        if held_out:
            axes.set_xscale("log")
            plain_ticks(axes.xaxis, LogLocator(subs=(1, 2, 5)))
            draw_held_out(axes, history, training)
        else:
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        if reached is not None:
            draw_reached(axes, reached, column)
        if len(history) >= LONG:
            lowest = min(np.nanmin(line.get_ydata()) for line in axes.lines if len(line.get_ydata()))
            axes.set_ylim(0.95 * lowest, 1.1 * highest_after_start(history, training))
        low, high = axes.get_ylim()
        plain_ticks(axes.yaxis, LogLocator(subs=(1, 2, 5)) if high > 10 * low else AutoLocator())
        axes.legend(loc="upper right", frameon=True, edgecolor="none")  # over a peak of the curves it stays readable
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--history", "history.csv of the surrogate")
    parser.add_input("--fit", "model.json of linear or linear_box, in the folder of this name", required=False)
    parser.add_input(
        "--coordinate-errors", "tables/coordinate_errors.csv, if held-out slurries are shown", required=False
    )
    parser.add_value("--test", "ids of the test slurries in it", nargs="*", default=[])
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the history and draw it."""
    reached = []
    if args.fit:
        reached.append(reached_on_particles(json.loads(args.fit.read_text(encoding="utf-8")), args.fit.parent.name))
    if args.coordinate_errors:
        reached.append(reached_on_slurries(read_table(args.coordinate_errors), args.test))
    history = read_table(args.history)
    save_figure(draw_learning_curves(history, pd.concat(reached) if reached else None), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
