"""Plot the density of every slurry against time in the DEM, and when each reaches equilibrium.

In: thermo.csv of each slurry (columns time_us, density_g_cm3), in the order of --slurries, and tables/equilibrium.csv
(columns slurry, role, mass_units, time_to_equilibrium_us, warning).
Out: PNG; the input frames of the surrogate are marked as a band, and equilibrium where no warning doubts it.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from slurrycast.data.tables import read_equilibrium, read_table
from slurrycast.report.figures import INK, PREDICTED, new_figure, save_figure
from slurrycast.runtime.command_line import Namespace, Parser, run_main

ROLES = {  # line and name
    "train": ("-", "training"),
    "validation": ("-.", "validation"),
    "test": ("--", "held out"),
    "new": (":", "new: only to the last input frame"),
}
# the pale end of the map is left out, since it vanishes on white
SIZES = ListedColormap(colormaps["GnBu"](np.linspace(0.4, 1.0, 256)))


def draw_densification(
    thermo: Mapping[str, pd.DataFrame], equilibrium: pd.DataFrame, input_times_us: Sequence[float]
) -> Figure:
    """Draw one curve for each slurry, coloured by mass; `thermo` and the index of `equilibrium` are by slurry."""
    figure = new_figure(9.5, 4.6)
    axes = figure.subplots()
    masses = equilibrium.mass_units
    scale = LogNorm(masses.min() * 0.999, masses.max() * 1.001)
    for slurry, curve in thermo.items():
        row = equilibrium.loc[slurry]
        colour = SIZES(scale(row.mass_units))
        axes.plot(curve.time_us, curve.density_g_cm3, ROLES[row.role][0], color=colour, lw=1.4)
        if pd.notna(row.time_to_equilibrium_us) and not row.warning:
            density = np.interp(row.time_to_equilibrium_us, curve.time_us, curve.density_g_cm3)
            axes.plot(row.time_to_equilibrium_us, density, "o", color=colour, mec=INK, ms=6, zorder=3)
    axes.axvspan(min(input_times_us), max(input_times_us), color=PREDICTED, alpha=0.18, lw=0)
    for time_us in input_times_us:
        axes.axvline(time_us, color=PREDICTED, lw=0.8)
    end_us = max(curve.time_us.max() for curve in thermo.values())
    axes.set(xlabel="Time (µs)", ylabel="Density (g/cm³)", xlim=(0, end_us))
    roles = {role: style for role, style in ROLES.items() if role in set(equilibrium.role)}
    handles = [Line2D([], [], color=INK, ls=line, label=label) for line, label in roles.values()]
    handles.append(Line2D([], [], color=PREDICTED, lw=5, alpha=0.5, label="input frames of the surrogate"))
    handles.append(Line2D([], [], ls="", marker="o", color=SIZES(0.5), mec=INK, label="equilibrium reached"))
    axes.legend(handles=handles, loc="lower right")
    bar = figure.colorbar(ScalarMappable(scale, SIZES), ax=axes, pad=0.01, aspect=30)
    ticks = sorted(set(masses))
    bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks], minor=False)
    bar.minorticks_off()
    bar.set_label("Mass of the slurry (units)")
    bar.outline.set_visible(False)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--slurries", "ids, in the order of --thermo", nargs="+")
    parser.add_input("--thermo", "thermo.csv of each slurry", nargs="+")
    parser.add_tables("equilibrium")
    parser.add_value("--input-frames", "frames given to the surrogate", nargs="+", type=int)
    parser.add_value("--frame-interval-us", "time between two frames in us", type=float)
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the curves and draw them."""
    thermo = {slurry: read_table(path) for slurry, path in zip(args.slurries, args.thermo, strict=True)}
    equilibrium = read_equilibrium(args.equilibrium).set_index("slurry")
    input_times_us = [frame * args.frame_interval_us for frame in args.input_frames]
    save_figure(draw_densification(thermo, equilibrium, input_times_us), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
