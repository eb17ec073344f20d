"""Plot the final density of each slurry, the DEM's and that of every surrogate's hybrid chain (the reference article's
Table 3).

In: tables/density_volume.csv (columns surrogate, slurry, model, density_g_cm3); DEM rows have the surrogate `-`.
Out: PNG. Upper panel: densities, with the reference article's values for the slurry of the same number; lower panel:
how far each hybrid density is from that of the DEM, in percent, on a scale that is linear up to 1 % and logarithmic
beyond.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from slurrycast.data.tables import read_table
from slurrycast.report import reference_article as article
from slurrycast.report.figures import ARTICLE, DEM, FAINT, new_figure, save_figure, surrogate_colours
from slurrycast.runtime.command_line import Namespace, Parser, run_main

SLOT = 0.84  # width of what belongs to one slurry; the slurries are 1 apart
LINEAR_PERCENT = 1.0


def draw_density(densities: pd.DataFrame, slurries: Sequence[str], surrogates: Sequence[str]) -> Figure:
    """Draw the densities of `slurries`; one that the DEM did not run to the end has no DEM line and no deviation."""
    by_slurry = densities.set_index("slurry").density_g_cm3
    dem = by_slurry[(densities.model == "DEM").to_numpy()].reindex(slurries)
    reported = {
        model: pd.Series({slurry: structure.density_g_cm3 for slurry, structure in structures.items()}, slurries)
        for model, structures in (("DEM", article.DEM_STRUCTURE), ("hybrid", article.HYBRID_STRUCTURE))
    }
    figure = new_figure(max(6.5, 1.2 + 1.05 * len(slurries)), 6.2 if dem.notna().any() else 3.9)
    upper, *lower = figure.subplots(2 if dem.notna().any() else 1, 1, sharex=True, squeeze=False)[:, 0]
    places = np.arange(len(slurries))
    known = reported["DEM"].notna().any()
    shifts = SLOT * ((np.arange(len(surrogates) + known) + 0.5) / (len(surrogates) + known) - 0.5)
    if dem.notna().any():
        upper.hlines(dem, places - SLOT / 2, places + SLOT / 2, color=DEM, lw=2, label="DEM")
    for surrogate, colour, shift in zip(surrogates, surrogate_colours(surrogates).values(), shifts, strict=False):
        hybrid = by_slurry[(densities.surrogate == surrogate).to_numpy()].reindex(slurries)
        upper.plot(places + shift, hybrid, "o", color=colour, ms=6.5, label=surrogate)
        for axes in lower:
            axes.plot(places + shift, 100 * (hybrid / dem - 1), "o", color=colour, ms=6.5)
    if known:
        style = {"color": ARTICLE, "mfc": "white", "mew": 1.4, "ms": 6}
        for model, marker in (("DEM", "D"), ("hybrid", "o")):
            label = f"{model} of the reference article"
            upper.plot(places + shifts[-1], reported[model], marker, label=label, **style)
        for axes in lower:
            axes.plot(places + shifts[-1], 100 * (reported["hybrid"] / reported["DEM"] - 1), "o", **style)
    upper.set(ylabel="Final density (g/cm³)")
    upper.margins(y=0.1)
    for axes in lower:
        axes.axhline(0, color=DEM, lw=1, zorder=1)
        axes.axhspan(-LINEAR_PERCENT, LINEAR_PERCENT, color=FAINT, alpha=0.3, lw=0, zorder=0)
        axes.set_yscale("symlog", linthresh=LINEAR_PERCENT, linscale=1.2)
        ticks = np.array([0, 0.5, 1, 3, 10, 30, 100])
        low, high = axes.get_ylim()
        axes.set_yticks([tick for tick in (*-ticks[:0:-1], *ticks) if 1.3 * low <= tick <= 1.3 * high], minor=False)
        axes.minorticks_off()
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_ylabel("Hybrid against\nits DEM (%)")
    last = [upper, *lower][-1]
    last.set(xticks=places, xticklabels=slurries, xlabel="Slurry", xlim=(-0.6, len(slurries) - 0.4))
    for axes in (upper, *lower):
        axes.grid(axis="x", visible=False)
        axes.vlines(places[1:] - 0.5, 0, 1, transform=axes.get_xaxis_transform(), color=FAINT, lw=0.6, zorder=0)
    figure.legend(loc="outside upper left", ncols=4 if len(slurries) > 6 else 2, columnspacing=1.2, handletextpad=0.4)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--density", "tables/density_volume.csv (g/cm3)")
    parser.add_value("--surrogates", "labels in the table, in the order of drawing", nargs="+")
    parser.add_value("--slurries", "slurries that went through the hybrid chain", nargs="+")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the table and draw it."""
    save_figure(draw_density(read_table(args.density), args.slurries, args.surrogates), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
