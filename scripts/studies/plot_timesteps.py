"""Plot how the timestep changes the end of a DEM run and its cost, and density against the size of a slurry.

In: both tables of compare_timesteps.py, and tables/equilibrium.csv for the slurries of all sizes.
Out: PNG; points are runs with different seeds, the line their mean at each timestep with two standard errors (none for
the RDF, whose differences share the runs that they are from); the band of the density is what
--max-density-difference accepts.
"""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator

from slurrycast.data.tables import read_equilibrium, read_table
from slurrycast.report.figures import DEM, FAINT, RELAXED, new_figure, plain_ticks, save_figure
from slurrycast.runtime.command_line import Namespace, Parser, run_main

PANELS = {
    "density_g_cm3": ("Density", "Density (g/cm³)", 1),
    "coordination_all": ("Contacts", "Mean contacts of a particle", 1),
    "overlap_mean": ("Overlap", "Mean overlap (% of Rᵢ + Rⱼ)", 100),
    "rdf_difference": ("RDF", "Mean |g − g of another seed\nat the smallest|", 1),
    "cpu_s": ("Cost", "LAMMPS (CPU s)", 1),
}


def draw_panel(axes: Axes, runs: pd.DataFrame, summary: pd.DataFrame, quantity: str) -> None:
    """Draw one quantity against the timestep."""
    title, label, factor = PANELS[quantity]
    mean = factor * summary[f"{quantity}_mean"]
    # None for the RDF: its differences share the runs that they are from, so they are not independent.
    two_errors = 2 * factor * summary[f"{quantity}_sd"] / summary.runs**0.5 if quantity != "rdf_difference" else None
    style = {"fmt": "-_", "color": DEM, "ms": 12, "mew": 2, "lw": 1, "capsize": 3}
    axes.errorbar(1e3 * summary.timestep_us, mean, two_errors, **style, label="mean ± 2 standard errors")
    axes.plot(1e3 * runs.timestep_us, factor * runs[quantity], "o", mfc="none", mec=RELAXED, ms=5, label="one run")
    axes.set(title=title, ylabel=label, xscale="log", xlabel="Timestep (ns)")
    plain_ticks(axes.xaxis, FixedLocator(1e3 * summary.timestep_us))
    axes.margins(x=0.1, y=0.12)


def draw_timesteps(
    runs: pd.DataFrame, summary: pd.DataFrame, equilibrium: pd.DataFrame, max_density_difference: float
) -> Figure:
    """Draw the quantities against the timestep, and density against the number of particles."""
    figure = new_figure(10.5, 6.2)
    panels = figure.subplots(2, 3).flat
    for quantity, axes in zip(PANELS, panels, strict=False):
        draw_panel(axes, runs, summary, quantity)
        if quantity == "density_g_cm3":
            reference = summary.density_g_cm3_mean.iloc[0]
            bounds = [reference * (1 + sign * max_density_difference) for sign in (-1, 1)]
            axes.axhspan(*bounds, color=FAINT, alpha=0.5, lw=0, zorder=0, label="accepted")
            axes.legend(fontsize=8)
        elif quantity == "rdf_difference":
            axes.set_ylim(bottom=0)
        elif quantity == "cpu_s":
            axes.set_yscale("log")
            plain_ticks(axes.yaxis, LogLocator(subs=(1, 2, 5)))
    sizes = panels[-1]
    complete = equilibrium[equilibrium.density_drift.notna()]
    sizes.plot(complete.particles, complete.density_g_cm3, "o", mfc="none", mec=RELAXED, ms=5)
    sizes.set(title="Size", xlabel="Particles", ylabel="Density (g/cm³)", xlim=(0, 1.08 * complete.particles.max()))
    sizes.margins(y=0.12)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--runs", "tables/timestep.csv")
    parser.add_input("--summary", "tables/timestep_summary.csv")
    parser.add_tables("equilibrium")
    parser.add_value("--max-density-difference", "as given to compare_timesteps.py", type=float)
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the tables and draw them."""
    runs, summary = read_table(args.runs), read_table(args.summary)
    equilibrium = read_equilibrium(args.equilibrium)
    save_figure(draw_timesteps(runs, summary, equilibrium, args.max_density_difference), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
