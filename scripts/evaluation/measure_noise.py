"""Measure the noise of the DEM: how far replicas of a slurry differ, and how far a perturbed run is from its original.

In: quantities and curves (CSV) of replicas, DEM runs of a slurry with other seeds and ids <slurry>_r<number>; frame
stores (HDF5) of perturbed runs, continued from the last input frame with slightly moved positions, and of their
originals.
Out: a table (CSV): slurry, particles, quantity, number of runs, mean and standard deviation (ddof = 1) of
the replicas. For rdf_<pair> these are of the mean |difference| of g(r) between two replicas, over all pairs of them and
all bins that all of them have. For perturbation_floor_um2, mean is the mean squared distance (um2) of one perturbed run
from its original at the target frame.
"""

from pathlib import Path

import pandas as pd

from slurrycast.data.frames import read_frames
from slurrycast.data.tables import read_table, write_table
from slurrycast.evaluation.noise import (
    COLUMNS,
    FLOOR,
    RDF_PREFIX,
    final_mse_um2,
    mean_and_sd,
    rdf_spread,
    replicated_slurry,
)
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError


def replica_rows(slurry: str, structure: pd.DataFrame, curves: pd.DataFrame) -> list[dict]:
    """Rows of the table for the replicas of one slurry; InputError if there is one only, or their sizes differ."""
    values = {quantity: rows.value.to_list() for quantity, rows in structure.groupby("quantity", sort=False)}
    sizes = values.pop("particles")
    if len(sizes) < 2 or len(set(sizes)) != 1:
        numbers = ", ".join(f"{size:g}" for size in sizes)
        raise InputError(f"slurry {slurry}: replicas of {numbers} particles, needed are two or more of the same size")
    measures = {quantity: (len(of_runs), *mean_and_sd(of_runs)) for quantity, of_runs in values.items()}
    for pair, rows in curves.groupby("pair", sort=False):
        of_runs = [curve for _, curve in rows.groupby("slurry", sort=False)]
        measures[f"{RDF_PREFIX}{pair}"] = (len(of_runs), *rdf_spread(of_runs))
    return [
        dict(zip(COLUMNS, (slurry, int(sizes[0]), quantity, *measure), strict=True))
        for quantity, measure in measures.items()
    ]


def perturbed_row(perturbed_path: Path, dem_path: Path, target_frame: int) -> dict:
    """Row of the table for one perturbed run."""
    with read_frames(perturbed_path) as perturbed, read_frames(dem_path) as dem:
        floor_um2 = final_mse_um2(perturbed, dem, target_frame)
        return {
            "slurry": dem.attributes["slurry"],
            "particles": len(dem.particles),
            "quantity": FLOOR,
            "runs": 1,
            "mean": floor_um2,
        }


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--structure", "quantities of all replicas (CSV)", nargs="+")
    parser.add_input("--rdf", "curves of the same replicas (CSV)", nargs="+")
    parser.add_input("--perturbed", "ends of the perturbed runs (HDF5)", nargs="+")
    parser.add_input("--frames", "DEM frames (HDF5), one for each of --perturbed, in order", nargs="+")
    parser.add_value("--target-frame", "number of the DEM frame to compare with", type=int)
    parser.add_output("--table", "table of the noise (CSV)")
    parser.one_each("structure", "rdf")
    parser.one_each("perturbed", "frames")


def main(args: Namespace) -> None:
    """Measure replicas and perturbed runs and write the table."""
    structure, curves = (pd.concat(map(read_table, paths)) for paths in (args.structure, args.rdf))
    rows = []
    for slurry, of_slurry in structure.groupby(structure.slurry.map(replicated_slurry), sort=False):
        rows += replica_rows(slurry, of_slurry, curves[curves.slurry.isin(of_slurry.slurry)])
    for perturbed_path, dem_path in zip(args.perturbed, args.frames, strict=True):
        rows.append(perturbed_row(perturbed_path, dem_path, args.target_frame))
    write_table(args.table, rows, columns=COLUMNS)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
