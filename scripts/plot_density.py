"""Plot the final density of each slurry, DEM against hybrid (the study's Table 3).

In: tables/density_volume.csv (columns surrogate, slurry, model, density_g_cm3); DEM rows have the surrogate `-`.
Out: PNG with a pair of points a slurry; the study's values for the slurry of the same number are marked.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from slurrycast import study
from slurrycast.figures import DEM, FAINT, RELAXED, STUDY, new_figure, save_figure
from slurrycast.files import run_main
from slurrycast.tables import read_table

SHIFT = 0.16  # our points stand left of the slurry's tick, the study's right of it


def draw_density(densities: pd.DataFrame, slurries: list[str], surrogate: str) -> Figure:
    """Draw both densities of `slurries`; a slurry that the DEM did not run to the end has no DEM point."""
    figure = new_figure(max(6.0, 1.2 + 1.0 * len(slurries)), 3.9)
    axes = figure.subplots()
    by_slurry = densities.set_index("slurry").density_g_cm3
    dem = by_slurry[(densities.model == "DEM").to_numpy()].reindex(slurries)
    hybrid = by_slurry[(densities.surrogate == surrogate).to_numpy()].reindex(slurries)
    places = np.arange(len(slurries))
    axes.vlines(places - SHIFT, dem, hybrid, color=FAINT, lw=4, zorder=1)
    for values, colour, label in ((dem, DEM, "DEM"), (hybrid, RELAXED, f"hybrid ({surrogate}, relaxed)")):
        if values.notna().any():
            axes.plot(places - SHIFT, values, "o", color=colour, ms=8, label=label)
    for place in places:
        pair = np.array([dem.iloc[place], hybrid.iloc[place]])
        for value, colour in zip(pair, (DEM, RELAXED), strict=True):
            if not np.isnan(value):
                above = value == np.nanmax(pair)
                offset, anchor = ((0, 7), "bottom") if above else ((0, -7), "top")
                position = {"xytext": offset, "textcoords": "offset points", "ha": "center", "va": anchor}
                axes.annotate(f"{value:.3f}", (place - SHIFT, value), color=colour, fontsize=8.5, **position)
    for structures, marker, label in (
        (study.DEM_STRUCTURE, "D", "DEM"),
        (study.HYBRID_STRUCTURE, "o", "hybrid"),
    ):
        known = [place for place, slurry in enumerate(slurries) if slurry in structures]
        if known:
            values = [structures[slurries[place]].density_g_cm3 for place in known]
            style = {"color": STUDY, "mfc": "white", "mew": 1.4, "ms": 6}
            axes.plot(np.array(known) + SHIFT, values, marker, label=f"{label} of the study (larger scale)", **style)
    axes.set(xticks=places, xticklabels=slurries, xlabel="Slurry", ylabel="Final density (g/cm³)")
    axes.set_xlim(-0.6, len(slurries) - 0.4)
    axes.margins(y=0.12)
    axes.grid(axis="x", visible=False)
    figure.legend(loc="outside upper left", ncols=4 if len(slurries) > 6 else 2, columnspacing=1.2, handletextpad=0.3)
    return figure


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--density", type=Path, required=True, help="in: tables/density_volume.csv")
    parser.add_argument("--surrogate", required=True, help="name of the surrogate in the table")
    parser.add_argument("--slurries", nargs="+", required=True, help="slurries that went through the hybrid chain")
    parser.add_argument("--figure", type=Path, required=True, help="out: PNG")
    return parser.parse_args()


def main() -> None:
    """Read the table and draw it."""
    args = parse_args()
    densities = read_table(args.density)
    save_figure(draw_density(densities, args.slurries, args.surrogate), args.figure)


if __name__ == "__main__":
    run_main(main)
