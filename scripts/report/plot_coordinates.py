"""Plot predicted against target coordinates of one slurry (the reference article's Fig. 3, 5).

In: predicted.h5 of each surrogate, in the order of --surrogates, and the DEM frames of the same slurry (H5MD, um).
Out: PNG with one row for each surrogate and one column for each axis: predicted against target with R2 and MSE, and
below it the deviation, coloured by phase.
Coordinates are unwrapped, and their mean over the particles is taken from both.
"""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from slurrycast.analysis.errors import CoordinateError, coordinate_errors
from slurrycast.data.frames import FrameStore, Particles, read_frames
from slurrycast.report.figures import INK, new_figure, phase_colours, phase_handles, save_figure
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def centred_position_um(store: FrameStore, k: int) -> np.ndarray:
    """Unwrapped coordinates (n, 3) in um at frame `k`, less their mean over the particles."""
    position_um = store.position_um(k)
    return position_um - position_um.mean(axis=0)


def draw_coordinates(
    target_um: np.ndarray,
    predicted_um: Mapping[str, np.ndarray],
    particles: Particles,
    errors: Mapping[str, Mapping[str, CoordinateError]],
) -> Figure:
    """Draw the panels of all surrogates and axes; positions have shape (n, 3), the last two are by surrogate.

    Upper panels have the same scale for every surrogate; the lower ones have one a surrogate, as errors differ much.
    """
    figure = new_figure(10, 0.6 + 3.3 * len(predicted_um))
    grid = figure.subplots(2 * len(predicted_um), 3, height_ratios=(2.2, 1) * len(predicted_um), sharex="col")
    colour_of_particle = np.array(phase_colours(particles.phase_names), dtype=object)[particles.phase - 1]
    order = np.random.default_rng(0).permutation(len(particles))  # no phase hides another
    size = np.clip(3000 / len(particles), 0.5, 6)
    style = {"c": colour_of_particle[order], "s": size, "linewidths": 0, "alpha": 0.8, "rasterized": True}
    for row, (surrogate, position_um) in enumerate(predicted_um.items()):
        farthest = 1.05 * np.abs(position_um - target_um).max()
        for axis, name in enumerate("xyz"):
            target, predicted = target_um[order, axis], position_um[order, axis]
            reach = 1.05 * np.abs([target_um[:, axis], *(other[:, axis] for other in predicted_um.values())]).max()
            upper, lower = grid[2 * row : 2 * row + 2, axis]
            upper.plot([-reach, reach], [-reach, reach], color=INK, lw=0.8, zorder=1)
            upper.scatter(target, predicted, **style)
            error = errors[surrogate][name]
            text = f"R² = {error.r2:.4f}\nMSE = {error.mse_um2:.3g} µm²"
            upper.text(0.04, 0.96, text, transform=upper.transAxes, va="top")
            upper.set(title=f"{surrogate}, {name} axis", ylim=(-reach, reach))
            lower.axhline(0, color=INK, lw=0.8, zorder=1)
            lower.scatter(target, predicted - target, **style)
            lower.set(xlim=(-reach, reach), ylim=(-farthest, farthest))
        grid[2 * row, 0].set_ylabel("predicted (µm)")
        grid[2 * row + 1, 0].set_ylabel("predicted −\ntarget (µm)")
    for axes, name in zip(grid[-1], "xyz", strict=True):
        axes.set_xlabel(f"target {name} (µm)")
    handles = phase_handles(particles.phase_names, 6)
    figure.legend(handles=handles, loc="outside upper right", ncols=len(handles), handletextpad=0.1)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--surrogates", "labels, in the order of --predicted", nargs="+")
    parser.add_input("--predicted", "predicted.h5 (one frame) of each", nargs="+")
    parser.add_input("--frames", "DEM frames of the same slurry")
    parser.add_value("--target-frame", "frame that was predicted", type=int)
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the structures and draw them."""
    predicted_um = {}
    for surrogate, path in zip(args.surrogates, args.predicted, strict=True):
        with read_frames(path) as store:
            predicted_um[surrogate] = centred_position_um(store, store.last)
    with read_frames(args.frames) as store:
        target_um = centred_position_um(store, args.target_frame)
        particles = store.particles
    errors = {name: coordinate_errors(target_um, position_um) for name, position_um in predicted_um.items()}
    save_figure(draw_coordinates(target_um, predicted_um, particles, errors), args.figure, colours=128)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
