"""Compare tapes from surrogates with those of the full DEM, in units of the scatter between tapes of the DEM.

In: tables/microstructure.csv, and tables (CSV) by measure_microstructure of the tapes of replicas, DEM runs of a slurry
with other seeds and ids <slurry>_r<number>.
Out: tables/tape_errors.csv, the rows of the tapes that the DEM has too, with surrogate for the source, and with
replica_sd, the standard deviation between tapes of replicas: pooled over all replicated slurries and scaled with
(number of particles)^-1/2.
"""

from pathlib import Path

import pandas as pd

from slurrycast.data.tables import read_table, write_table
from slurrycast.evaluation.noise import COLUMNS, Noise, mean_and_sd, replicated_slurry
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def noise_of(replicas: pd.DataFrame) -> pd.DataFrame:
    """Scatter of each quantity between the replicas of a slurry, in the columns of tables/noise.csv."""
    particles = replicas[replicas.quantity == "particles"].set_index("slurry").value
    groups = replicas.groupby([replicas.slurry.map(replicated_slurry), "quantity"], sort=False)
    rows = [
        (slurry, int(particles[rows.slurry.iloc[0]]), quantity, len(rows), *mean_and_sd(rows.value))
        for (slurry, quantity), rows in groups
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--microstructure", "tables/microstructure.csv")
    parser.add_input("--replicas", "quantities of the tapes of replicas (CSV)", nargs="+")
    parser.add_output("--table", "table of errors (CSV)")


def main(args: Namespace) -> None:
    """Compare every tape and write the table."""
    rows = read_table(args.microstructure)
    particles = rows[rows.quantity == "particles"].groupby("slurry").value.first()
    noise = Noise(Path(args.table), noise_of(pd.concat(map(read_table, args.replicas))))
    tapes = rows[(rows.stage == "tape") & (rows.source != "dem") & rows.dem_value.notna()]
    spread = [noise.spread(row.quantity, particles[row.slurry]) for row in tapes.itertuples()]
    write_table(args.table, tapes.rename(columns={"source": "surrogate"}).assign(replica_sd=spread))


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
