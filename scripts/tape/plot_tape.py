"""Plot the pore sizes of the tapes of one slurry, and the shares of phases and void along z.

In: distribution of pore sizes and profile (CSV, by measure_microstructure) of the tape from each of --sources.
Out: PNG. Along z, the full DEM is drawn in full lines, and of the surrogates only the first one, in dashed ones.
Without a DEM, the first two are drawn like this.
"""

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from slurrycast.data.tables import read_table
from slurrycast.report.figures import DEM, INK, new_figure, phase_colours, save_figure, surrogate_colours
from slurrycast.report.names import source_name
from slurrycast.runtime.command_line import Namespace, Parser, run_main

VOID = "#95a0a9"


def draw_tape(pores: Mapping[str, pd.DataFrame], profiles: Mapping[str, pd.DataFrame]) -> Figure:
    """Draw both panels; tables are by source."""
    surrogates = surrogate_colours([source for source in pores if source != "dem"])
    names = list(dict.fromkeys(next(iter(profiles.values())).phase))
    phases = [name for name in names if name != "void"]
    colours = dict(zip(phases, phase_colours(phases), strict=True)) | {"void": VOID}
    figure = new_figure(9.5, 3.6)
    sizes, along_z = figure.subplots(1, 2)
    for source, table in pores.items():
        sizes.plot(table.diameter_um, table.share_below, color=surrogates.get(source, DEM), label=source_name(source))
    sizes.set(xlabel="Pore size (µm)", ylabel="Share of the void in smaller pores", ylim=(0, 1))
    sizes.set_xlim(left=0)
    sizes.legend(loc="lower right")
    full = "dem" if "dem" in profiles else next(iter(profiles))
    lines = {source: "-" if source == full else "--" for source in list(profiles)[:2]}  # more would hide each other
    for source, line in lines.items():
        for name, rows in profiles[source].groupby("phase", sort=False):
            along_z.plot(rows.share, rows.z_um, color=colours[name], ls=line, lw=1.3)
    handles = [Line2D([], [], color=colours[name], label=name) for name in names]
    if len(profiles) > 1:
        handles += [Line2D([], [], color=INK, ls=line, label=source_name(source)) for source, line in lines.items()]
    along_z.set(xlabel="Share of the volume", ylabel="z (µm)")
    along_z.set_xlim(left=0)
    along_z.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--sources", "dem or a surrogate, in the order of the tables", nargs="+")
    parser.add_input("--pores", "distributions of pore sizes (CSV)", nargs="+")
    parser.add_input("--profiles", "shares along z (CSV)", nargs="+")
    parser.add_output("--figure", "PNG")
    parser.one_each("sources", "pores")
    parser.one_each("sources", "profiles")


def main(args: Namespace) -> None:
    """Read the tables and draw them."""
    pores, profiles = (
        {source: read_table(path) for source, path in zip(args.sources, paths, strict=True)}
        for paths in (args.pores, args.profiles)
    )
    save_figure(draw_tape(pores, profiles), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
