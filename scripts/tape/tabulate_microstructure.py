"""Put the microstructures of slurries and tapes into one table, beside those of the DEM.

In: tables (CSV) by measure_microstructure, of slurries and tapes from each source.
Out: a table (CSV) of their rows with dem_value, that of the same slurry by the full DEM, which slurries of role new do
not have.
"""

import pandas as pd

from slurrycast.data.tables import read_table, write_table
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--microstructures", "quantities of slurries and tapes (CSV)", nargs="+")
    parser.add_output("--table", "table of all (CSV)")


def main(args: Namespace) -> None:
    """Read all tables and write one."""
    rows = pd.concat(map(read_table, args.microstructures))
    keys = ["slurry", "stage", "quantity"]
    dem = rows[rows.source == "dem"].set_index(keys).value.rename("dem_value")
    write_table(args.table, rows.join(dem, on=keys))


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
