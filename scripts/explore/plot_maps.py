"""Draw maps of the properties of tapes over the inputs of their recipes.

In: tables/explore.csv, tables/explore_noise.csv, tables/explore_models.csv and the maps of
fit_properties.
Out: PNG, a panel for each property that is resolved, over the two inputs with the highest total index, all others at
the centre of their ranges. White has no recipe: the last mass fraction would leave its range. Dots are the recipes that
were computed, whose other inputs differ. The titles give the mean half width of the 90 % interval.
"""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slurrycast.data.tables import read_table
from slurrycast.report.figures import INK, new_figure, save_figure
from slurrycast.report.names import input_name, tape_quantity
from slurrycast.runtime.command_line import Namespace, Parser, run_main

COLUMNS = 3
LEVELS = 10


def draw_map(axes: Axes, grid: pd.DataFrame, table: pd.DataFrame, title: str) -> None:
    """Draw one map; `grid` has the rows of one property, `table` the recipes."""
    first, second = grid.x_input.iloc[0], grid.y_input.iloc[0]
    values = grid.pivot(index="y", columns="x", values="mean")
    filled = axes.contourf(values.columns, values.index, values, LEVELS, cmap="viridis")
    lines = axes.contour(values.columns, values.index, values, LEVELS, colors="white", linewidths=0.5)
    axes.clabel(lines, lines.levels[1:-1:2], fontsize=7.5, fmt="%.3g")
    axes.plot(table[first], table[second], "o", ms=2.6, color=INK, mec="white", mew=0.4)
    axes.figure.colorbar(filled, ax=axes, format="%.3g", pad=0.02)
    axes.set(xlabel=input_name(first), ylabel=input_name(second))
    axes.set_title(f"{title}\n± {grid.half_width.mean():.2g}", fontsize=9.5)
    axes.grid(False)


def draw_maps(maps: pd.DataFrame, table: pd.DataFrame, units: pd.Series) -> Figure:
    """Draw all maps; `units` of the properties by name. With one input alone there are none."""
    groups = dict(list(maps[maps.x_input != maps.y_input].groupby("property", sort=False)))
    rows = -(-len(groups) // COLUMNS)
    figure = new_figure(4.2 * COLUMNS, 3.5 * max(rows, 1))
    panels = figure.subplots(max(rows, 1), COLUMNS, squeeze=False).ravel()
    for axes, (name, grid) in zip(panels, groups.items(), strict=False):
        draw_map(axes, grid, table, tape_quantity(name, units[name]))
    for axes in panels[len(groups) :]:
        axes.remove()
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("explore", "explore_noise", "explore_models")
    parser.add_input("--maps", "maps of fit_properties (CSV)")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the tables and draw."""
    units = read_table(args.explore_noise).astype({"unit": str}).set_index("property").unit
    models, maps = read_table(args.explore_models), read_table(args.maps)
    maps = maps[maps.property.isin(models.property[models.resolved == "yes"])]
    save_figure(draw_maps(maps, read_table(args.explore), units), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
