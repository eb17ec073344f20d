"""Compare predicted and relaxed structures with those of the DEM, beside the noise of the DEM.

In: quantities and curves (CSV) of any number of surrogates and slurries, those of the DEM for the same slurries, the
noise of the DEM (CSV) and the curves of its replicas (CSV).
Out: a table (CSV) of one row a surrogate, slurry, stage and quantity: its value, that of the DEM, and replica_sd, the
standard deviation between DEM runs with other seeds. For rdf_<pair>, value is the mean |g - g_dem| over the bins that
the DEM and all stages of the surrogate have, dem_value is 0, and replica_sd the mean difference between two such runs
over the same bins, as far as the boxes of the replicas reach. replica_sd is pooled over all replicated slurries and
scaled with (number of particles)^-1/2, and missing where no replica has the quantity. A quantity that only one of the
two structures has, as windows do not fit into the other one's box, has no row.
"""

from pathlib import Path

import pandas as pd

from slurrycast.data.tables import read_table, write_table
from slurrycast.evaluation.noise import RDF_PREFIX, Noise, curves_of_replicas, rdf_difference, read_noise
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

COLUMNS = ("surrogate", "slurry", "stage", "quantity", "value", "dem_value", "replica_sd")


def error_rows(
    structure_path: Path, rdf_path: Path, dem: dict, dem_curves: dict, noise: Noise, replica_curves: dict
) -> list[dict]:
    """Rows of the table for one surrogate and slurry.

    `dem` has the values and `dem_curves` the curves of the DEM by (slurry, quantity) and (slurry, pair),
    `replica_curves` those of the replicas as `Noise.rdf_spread` takes them. InputError if the DEM's are missing, or the
    two files are not of the same structures.
    """
    structure, curves = read_table(structure_path), read_table(rdf_path)
    keys = ["surrogate", "slurry", "stage"]
    if set(structure[keys].itertuples(index=False)) != set(curves[keys].itertuples(index=False)):
        raise InputError(f"{rdf_path}: not the curves of the structures in {structure_path}")
    slurry = structure.slurry.iloc[0]
    particles = int(structure.value[structure.quantity == "particles"].iloc[0])
    rdf = {}
    for pair, of_pair in curves.groupby("pair", sort=False):
        by_stage = dict(iter(of_pair.groupby("stage")))
        if (slurry, pair) not in dem_curves:
            raise InputError(f"slurry {slurry}: no RDF {pair} of the DEM to compare with")
        of_dem = dem_curves[slurry, pair]
        # The same for all stages, as in tables/rdf_errors.csv: the noise of g falls with r.
        bins = min(map(len, [of_dem, *by_stage.values()]))
        spread = noise.rdf_spread(pair, particles, replica_curves, bins)
        for stage, curve in by_stage.items():
            rdf[stage, f"{RDF_PREFIX}{pair}"] = rdf_difference(curve[:bins], of_dem[:bins]), 0.0, spread
    rows = []
    for (*names, stage), of_stage in structure.groupby(keys, sort=False):
        measured = of_stage[of_stage.quantity != "particles"]
        compared = {
            quantity: (value, dem[slurry, quantity], noise.spread(quantity, particles))
            for quantity, value in zip(measured.quantity, measured.value, strict=True)
            if (slurry, quantity) in dem
        }
        compared |= {quantity: values for (of, quantity), values in rdf.items() if of == stage}
        rows += [
            dict(zip(COLUMNS, (*names, stage, quantity, *values), strict=True)) for quantity, values in compared.items()
        ]
    return rows


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--structure", "quantities of surrogates and slurries (CSV)", nargs="*")
    parser.add_input("--rdf", "curves (CSV), one file for each --structure, in order", nargs="*")
    parser.add_input("--dem-structure", "quantities of the DEM (CSV)", nargs="*")
    parser.add_input("--dem-rdf", "curves of the DEM (CSV)", nargs="*")
    parser.add_input("--noise", "noise of the DEM (CSV)")
    parser.add_input("--replica-rdf", "curves of the replicas that the noise is of (CSV)", nargs="*")
    parser.add_output("--table", "table of structural errors (CSV)")
    parser.one_each("structure", "rdf")


def main(args: Namespace) -> None:
    """Compare every structure and write the table."""
    noise = read_noise(args.noise)
    dem = {
        (row.slurry, row.quantity): row.value
        for path in args.dem_structure
        for row in read_table(path).itertuples(index=False)
    }
    dem_curves = {key: curve for path in args.dem_rdf for key, curve in read_table(path).groupby(["slurry", "pair"])}
    tables = [read_table(path) for path in args.replica_rdf]
    replica_curves = curves_of_replicas(pd.concat(tables)) if tables else {}
    rows = []
    for structure_path, rdf_path in zip(args.structure, args.rdf, strict=True):
        rows += error_rows(structure_path, rdf_path, dem, dem_curves, noise, replica_curves)
    write_table(args.table, rows, columns=COLUMNS)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
