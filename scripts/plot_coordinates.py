"""Plot predicted against target coordinates of one slurry, one panel an axis (the study's Fig. 3 and 5).

In: predicted.h5 and the DEM frames of the same slurry (H5MD, um).
Out: PNG; upper panels predicted against target with R2 and MSE, lower panels the deviation, coloured by phase.
Coordinates are unwrapped, and their mean over the particles is taken from both.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from slurrycast.errors import CoordinateError, coordinate_errors
from slurrycast.figures import INK, new_figure, phase_colours, save_figure
from slurrycast.files import run_main
from slurrycast.frames import FrameStore, Particles, read_frames


def centred_position_um(store: FrameStore, k: int) -> np.ndarray:
    """Unwrapped coordinates (n, 3) in um at frame `k`, less their mean over the particles."""
    position_um = store.position_um(k)
    return position_um - position_um.mean(axis=0)


def draw_coordinates(
    target_um: np.ndarray, predicted_um: np.ndarray, particles: Particles, errors: dict[str, CoordinateError]
) -> Figure:
    """Draw the panels of all three axes; positions have shape (n, 3)."""
    figure = new_figure(10, 5.2)
    grid = figure.subplots(2, 3, height_ratios=(2.2, 1), sharex="col")
    colours = phase_colours(particles.phase_names)
    colour_of_particle = np.array(colours, dtype=object)[particles.phase - 1]
    order = np.random.default_rng(0).permutation(len(particles))  # no phase hides another
    size = np.clip(3000 / len(particles), 0.5, 6)
    farthest = 1.05 * np.abs(predicted_um - target_um).max()
    for axis, name in enumerate("xyz"):
        target, predicted = target_um[order, axis], predicted_um[order, axis]
        reach = 1.05 * np.abs([target, predicted]).max()
        style = {"c": colour_of_particle[order], "s": size, "linewidths": 0, "alpha": 0.8, "rasterized": True}
        upper, lower = grid[:, axis]
        upper.plot([-reach, reach], [-reach, reach], color=INK, lw=0.8, zorder=1)
        upper.scatter(target, predicted, **style)
        error = errors[name]
        text = f"R² = {error.r2:.4f}\nMSE = {error.mse_um2:.3g} µm²"
        upper.text(0.04, 0.96, text, transform=upper.transAxes, va="top")
        upper.set(title=f"{name} axis", ylim=(-reach, reach))
        lower.axhline(0, color=INK, lw=0.8, zorder=1)
        lower.scatter(target, predicted - target, **style)
        lower.set(xlabel=f"target {name} (µm)", xlim=(-reach, reach), ylim=(-farthest, farthest))
    grid[0, 0].set_ylabel("predicted (µm)")
    grid[1, 0].set_ylabel("predicted −\ntarget (µm)")
    figure.legend(
        handles=[
            Line2D([], [], ls="", marker="o", ms=6, color=colour, label=name)
            for colour, name in zip(colours, particles.phase_names, strict=True)
        ],
        loc="outside upper right",
        ncols=len(colours),
        handletextpad=0.1,
    )
    return figure


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--predicted", type=Path, required=True, help="in: predicted.h5 (one frame)")
    parser.add_argument("--frames", type=Path, required=True, help="in: DEM frames of the same slurry")
    parser.add_argument("--target-frame", type=int, required=True, help="frame that was predicted")
    parser.add_argument("--figure", type=Path, required=True, help="out: PNG")
    return parser.parse_args()


def main() -> None:
    """Read both structures and draw them."""
    args = parse_args()
    with read_frames(args.predicted) as store:
        predicted_um = centred_position_um(store, store.last)
    with read_frames(args.frames) as store:
        target_um = centred_position_um(store, args.target_frame)
        particles = store.particles
    errors = coordinate_errors(target_um, predicted_um)
    save_figure(draw_coordinates(target_um, predicted_um, particles, errors), args.figure)


if __name__ == "__main__":
    run_main(main)
