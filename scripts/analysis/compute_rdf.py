"""Compute the radial distribution functions of one slurry: target (DEM), predicted and relaxed structure.

In: frame stores (HDF5) of the predicted and the relaxed structure, and of the DEM if it has the target.
Out: a table (CSV) of one row for each pair of phases (`all` and the pair asked for, if any) and bin: r_um, the centre
of the bin, and g_dem, g_predicted, g_relaxed, dimensionless; g_dem is empty without a target frame. The bin width is
cutoff / bins; the range ends at min(cutoff, 0.49 x the shortest edge of the boxes compared).
"""

import contextlib

import numpy as np
import pandas as pd

from slurrycast.analysis.rdf import bin_centres_um, bin_edges_um, radial_distributions
from slurrycast.data.frames import FrameStore, Particles, read_frames
from slurrycast.data.tables import write_table
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import InputError


def pair_name(particles: Particles, phases: list[str]) -> str:
    """Name of a pair of `phases`, in any order, among the curves; InputError if too few particles form it."""
    for name in phases:
        if name not in particles.phase_names or not particles.in_phase(name).any():
            raise InputError(f"--pair {name}: no such particles, phases are {', '.join(particles.phase_names)}")
    if phases[0] == phases[1] and particles.in_phase(phases[0]).sum() == 1:
        raise InputError(f"--pair {' '.join(phases)}: there is 1 particle of {phases[0]}, must be at least 2")
    return "-".join(sorted(phases, key=particles.phase_names.index))


def rdf_table(
    structures: dict[str, tuple[FrameStore, int]], phases: list[str] | None, cutoff_um: float, bins: int
) -> pd.DataFrame:
    """Curves of all `structures` (name of the column: store and frame number) in the same bins."""
    first, *others = (store for store, _ in structures.values())
    for store in others:
        store.check_same_particles(first)
    particles = first.particles
    r_edges_um = bin_edges_um(cutoff_um, bins, [store.box(frame)[1] for store, frame in structures.values()])
    pairs = {"all": "all"} | ({"-".join(phases): pair_name(particles, phases)} if phases else {})
    curves = {
        column: radial_distributions(store.position_um(k), *store.box(k), particles, r_edges_um)
        for column, (store, k) in structures.items()
    }
    r_um = bin_centres_um(r_edges_um)
    tables = [
        pd.DataFrame({"pair": pair, "r_um": r_um} | {column: g.get(name, np.nan) for column, g in curves.items()})
        for pair, name in pairs.items()
    ]
    return pd.concat(tables)


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--predicted", "predicted structure (HDF5)")
    parser.add_input("--relaxed", "relaxed structure (HDF5)")
    parser.add_target()
    parser.add_value("--cutoff-um", "longest distance wanted, um", type=float)
    parser.add_value("--bins", "number of bins up to --cutoff-um", type=int)
    parser.add_value("--pair", "two phases, beside all particles", nargs=2, metavar="PHASE", default=None)
    parser.add_output("--rdf", "curves (CSV)")
    parser.add_output("--cost", "cost record (JSON)")


def main(args: Namespace) -> None:
    """Compute the curves of one slurry and write them."""
    with measured_cost(args.cost, "compute_rdf") as cost, contextlib.ExitStack() as files:
        predicted, relaxed = (files.enter_context(read_frames(path)) for path in (args.predicted, args.relaxed))
        cost.surrogate, cost.slurry = (str(predicted.attributes[key]) for key in ("surrogate", "slurry"))
        cost.particles = len(predicted.particles)
        structures = {"g_predicted": (predicted, predicted.last), "g_relaxed": (relaxed, relaxed.last)}
        if args.frames is not None:
            structures = {"g_dem": (files.enter_context(read_frames(args.frames)), args.target_frame)} | structures
        table = rdf_table(structures, args.pair, args.cutoff_um, args.bins)
        table.insert(0, "surrogate", cost.surrogate)
        table.insert(1, "slurry", cost.slurry)
        columns = ["surrogate", "slurry", "pair", "r_um", "g_dem", "g_predicted", "g_relaxed"]
        write_table(args.rdf, table.reindex(columns=columns))


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
