"""Plot thickness and density of tapes while the solvent leaves.

In: drying.csv of each tape, with its source (dem or a surrogate) in the order of --sources.
Out: PNG: the thickness over that of the slurry, the density, and the void between the particles, against the share of
the solvent that has left. A dot is the tape at rest.
"""

from collections.abc import Sequence

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from slurrycast.data.tables import read_table
from slurrycast.report.figures import DEM, new_figure, save_figure, surrogate_colours
from slurrycast.report.names import source_name
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def draw_drying(sources: Sequence[str], tables: Sequence[pd.DataFrame]) -> Figure:
    """Draw one curve for each tape in the colour of its source."""
    colours = surrogate_colours([source for source in dict.fromkeys(sources) if source != "dem"]) | {"dem": DEM}
    figure = new_figure(9.5, 3.4)
    panels = {
        "Thickness / that of the slurry": lambda table: table.thickness_um / table.thickness_um.iloc[0],
        "Density (g/cm³)": lambda table: table.density_g_cm3,
        "Void between the particles": lambda table: 1 - table.packing_fraction,
    }
    for axes, (name, values) in zip(figure.subplots(1, len(panels)), panels.items(), strict=True):
        for source, table in zip(sources, tables, strict=True):
            drawn = values(table)
            axes.plot(1 - table.solvent_left, drawn, color=colours[source], lw=1.2, alpha=0.8)
            axes.plot(1, drawn.iloc[-1], "o", color=colours[source], ms=4, clip_on=False)
        axes.set(xlabel="Solvent that has left", ylabel=name, xlim=(0, 1))
    handles = [Line2D([], [], color=colours[source], label=source_name(source)) for source in dict.fromkeys(sources)]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--sources", "of each tape, in the order of --drying", nargs="+")
    parser.add_input("--drying", "drying.csv of each tape", nargs="+")
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the tables and draw them."""
    save_figure(draw_drying(args.sources, [read_table(path) for path in args.drying]), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
