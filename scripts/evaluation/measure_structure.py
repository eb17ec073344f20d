"""Measure the structure of one slurry: that of the DEM at the target frame, or the predicted and the relaxed one.

In: a frame store (HDF5) of the DEM, or those of the predicted and of the relaxed structure.
Out: two tables (CSV), with the surrogate (`-` for the DEM), the slurry and the stage (target, predicted or relaxed):
of quantities (particles, density_g_cm3, mean contacts coordination_all and coordination_<A>-<B> of an A particle with B
particles, share_below_4_contacts, overlap_mean and overlap_max as shares of Ri + Rj, packing_nominal and packing_union,
coarseness_<w>um_<A> of phase A in windows of 2 and 4 um that fit into the box), and of g(r) for `all` and every pair of
phases: r_um, the centre of the bin, and g. The bin width is cutoff / bins; the range ends at
min(cutoff, 0.49 x the shortest edge of the structure's own box).
"""

import contextlib

import pandas as pd

from slurrycast.analysis.rdf import bin_centres_um, bin_edges_um, radial_distributions
from slurrycast.analysis.structure import structure_measures
from slurrycast.data.frames import FrameStore, read_frames
from slurrycast.data.tables import write_table
from slurrycast.runtime.command_line import Namespace, Parser, run_main

STRUCTURE_COLUMNS = ("surrogate", "slurry", "stage", "quantity", "value")
RDF_COLUMNS = ("surrogate", "slurry", "stage", "pair", "r_um", "g")


def tables_of(store: FrameStore, frame: int, stage: str, cutoff_um: float, bins: int) -> list[pd.DataFrame]:
    """Table of quantities and table of curves of one structure."""
    position_um, (lower_um, edges_um) = store.position_um(frame), store.box(frame)
    measures = structure_measures(position_um, lower_um, edges_um, store.particles)
    r_edges_um = bin_edges_um(cutoff_um, bins, [edges_um])
    curves = radial_distributions(position_um, lower_um, edges_um, store.particles, r_edges_um)
    r_um = bin_centres_um(r_edges_um)
    tables = [
        pd.DataFrame({"quantity": measures.keys(), "value": measures.values()}),
        pd.concat([pd.DataFrame({"pair": pair, "r_um": r_um, "g": g}) for pair, g in curves.items()]),
    ]
    surrogate = store.attributes["surrogate"] if stage != "target" else "-"
    return [table.assign(surrogate=surrogate, slurry=store.attributes["slurry"], stage=stage) for table in tables]


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--dem", "DEM frames of the slurry (HDF5), with --target-frame", required=False)
    parser.add_value("--target-frame", "number of the DEM frame to measure", type=int, default=None)
    parser.add_input("--predicted", "predicted structure (HDF5), with --relaxed", required=False)
    parser.add_input("--relaxed", "relaxed structure (HDF5)", required=False)
    parser.add_value("--cutoff-um", "longest distance wanted, um", type=float)
    parser.add_value("--bins", "number of bins up to --cutoff-um", type=int)
    parser.add_output("--structure", "quantities (CSV)")
    parser.add_output("--rdf", "curves (CSV)")
    parser.add_check(wrong_mix)


def wrong_mix(args: Namespace) -> str | None:
    """What is wrong if the inputs are neither those of the DEM nor those of a prediction."""
    inputs = [name for name in ("dem", "target_frame", "predicted", "relaxed") if getattr(args, name) is not None]
    fits = inputs in (["dem", "target_frame"], ["predicted", "relaxed"])
    return None if fits else "either --dem and --target-frame, or --predicted and --relaxed are needed"


def main(args: Namespace) -> None:
    """Measure the structures and write both tables."""
    with contextlib.ExitStack() as files:
        if args.dem:
            dem = files.enter_context(read_frames(args.dem))
            structures = [(dem, args.target_frame, "target")]
        else:
            stores = [files.enter_context(read_frames(path)) for path in (args.predicted, args.relaxed)]
            structures = [
                (store, store.last, stage) for store, stage in zip(stores, ("predicted", "relaxed"), strict=True)
            ]
        results = [tables_of(*structure, args.cutoff_um, args.bins) for structure in structures]
        for path, tables, columns in zip(
            (args.structure, args.rdf), zip(*results, strict=True), (STRUCTURE_COLUMNS, RDF_COLUMNS), strict=True
        ):
            write_table(path, pd.concat(tables), columns=columns)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
