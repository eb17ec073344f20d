"""Put the microstructures of slurries and tapes into one table, beside those of the DEM and their scatter.

In: tables (CSV) by measure_microstructure, of slurries and tapes from each source, and the same of replicas, DEM runs
of a slurry with other seeds and ids <slurry>_r<number>.
Out: a table (CSV) of the rows of the former with dem_value, that of the same slurry by the full DEM, which slurries of
role new do not have, and with replica_sd, the standard deviation between replicas: pooled over all replicated slurries
and scaled with (number of particles)^-1/2. It is empty where no two replicas have the quantity.
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
        (slurry, int(particles[rows.slurry.iloc[0]]), quantity, rows.value.count(), *mean_and_sd(rows.value.dropna()))
        for (slurry, quantity), rows in groups
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def replica_sd(rows: pd.DataFrame, replicas: pd.DataFrame) -> list[float]:
    """Scatter between replicas of what each row measures, at its number of particles and in its stage."""
    particles = rows[rows.quantity == "particles"].groupby("slurry").value.first()
    noise = {stage: Noise(Path(stage), noise_of(of_stage)) for stage, of_stage in replicas.groupby("stage")}
    return [
        noise[row.stage].spread(row.quantity, particles[row.slurry]) if row.stage in noise else float("nan")
        for row in rows.itertuples()
    ]


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--microstructures", "quantities of slurries and tapes (CSV)", nargs="+")
    parser.add_input("--replicas", "the same of replicas (CSV)", nargs="*")
    parser.add_output("--table", "table of all (CSV)")


def main(args: Namespace) -> None:
    """Read all tables and write one."""
    rows, replicas = (
        pd.concat(map(read_table, paths)) if paths else None for paths in (args.microstructures, args.replicas)
    )
    keys = ["slurry", "stage", "quantity"]
    dem = rows[rows.source == "dem"].set_index(keys).value.rename("dem_value")
    rows = rows.join(dem, on=keys)
    write_table(args.table, rows.assign(replica_sd=float("nan") if replicas is None else replica_sd(rows, replicas)))


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
