"""Compare what becomes of predictions after relaxations of several lengths with the end of the DEM, beside its noise.

In: relaxed structures (HDF5) of any surrogates, slurries and numbers of steps, the cost record (JSON) of each of them,
quantities (CSV) of the predictions, quantities and curves (CSV) of the DEM for the same slurries, the noise of the DEM
(CSV) and the curves of its replicas (CSV).
Out: a table (CSV) of one row a surrogate, slurry and number of steps: overlap_mean_predicted (mean of 1 - distance /
(Ri + Rj) over the contacts of the prediction, before relaxation), density_error (density / density of the DEM - 1),
density_in_sd (its size in standard deviations of DEM runs with other seeds), rdf_in_spread (mean |g - g_dem| of all
particles over the mean difference between two such runs, over the bins that the DEM and all relaxations of the
prediction have), coordination_in_sd (of the mean number of contacts of a particle, as of the density), cpu_s of the
relaxation, and within_band: density and contacts within 2 standard deviations, and the systematic part of the RDF
within 2 of those of g, which is an rdf_in_spread of at most sqrt(3) (see `verdicts.in_noise`).
"""

import json

import pandas as pd

from slurrycast.analysis.rdf import bin_centres_um, bin_edges_um, radial_distributions
from slurrycast.analysis.structure import structure_measures
from slurrycast.data.frames import FrameStore, read_frames
from slurrycast.data.tables import read_table, write_table
from slurrycast.evaluation.noise import curves_of_replicas, read_noise
from slurrycast.evaluation.relaxation import COLUMNS, Structure, relaxation_errors
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import read_cost
from slurrycast.runtime.files import InputError


def structure_of(store: FrameStore, cutoff_um: float, bins: int) -> Structure:
    """Density, RDF and contacts of the last frame."""
    position_um, (lower_um, edges_um) = store.position_um(store.last), store.box(store.last)
    measures = structure_measures(position_um, lower_um, edges_um, store.particles)
    r_edges_um = bin_edges_um(cutoff_um, bins, [edges_um])
    g = radial_distributions(position_um, lower_um, edges_um, store.particles, r_edges_um)["all"]
    curve = pd.DataFrame({"r_um": bin_centres_um(r_edges_um), "g": g})
    return Structure(measures["density_g_cm3"], curve, measures["coordination_all"])


def one_value(table: pd.DataFrame, quantity: str, of: str) -> float:
    """The value of a quantity. InputError if there is none, or several."""
    values = table.value[table.quantity == quantity]
    if len(values) != 1:
        raise InputError(f"{of}: {len(values)} values of {quantity}, needed is one")
    return float(values.iloc[0])


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--relaxed", "relaxed structures (HDF5)", nargs="+")
    parser.add_input("--relaxation-costs", "their cost records (JSON) of relax_slurry, in order", nargs="+")
    parser.add_input("--structure", "quantities of the predictions (CSV)", nargs="+")
    parser.add_input("--dem-structure", "quantities of the DEM (CSV)", nargs="+")
    parser.add_input("--dem-rdf", "curves of the DEM (CSV)", nargs="+")
    parser.add_input("--noise", "noise of the DEM (CSV)")
    parser.add_input("--replica-rdf", "curves of the replicas that the noise is of (CSV)", nargs="+")
    parser.add_value("--cutoff-um", "longest distance wanted, um, as of the curves", type=float)
    parser.add_value("--bins", "number of bins up to --cutoff-um, as of the curves", type=int)
    parser.add_output("--table", "table of all relaxations (CSV)")
    parser.one_each("relaxed", "relaxation_costs")


def main(args: Namespace) -> None:
    """Measure the relaxed structures, compare them and write the table."""
    noise = read_noise(args.noise)
    replica_curves = curves_of_replicas(pd.concat(map(read_table, args.replica_rdf)))
    measured = pd.concat(map(read_table, args.structure))
    dem_structure, dem_rdf = (pd.concat(map(read_table, paths)) for paths in (args.dem_structure, args.dem_rdf))
    relaxed, cpu_s, particles = {}, {}, {}
    for path, cost_path in zip(args.relaxed, args.relaxation_costs, strict=True):
        with read_frames(path) as store:
            surrogate, slurry = key = tuple(str(store.attributes[name]) for name in ("surrogate", "slurry"))
            steps, cost = json.loads(store.attributes["relaxation"])["steps"], read_cost(cost_path)
            if (cost.surrogate, cost.slurry, cost.steps) != (surrogate, slurry, steps):
                raise InputError(f"{cost_path}: not the cost of {path}")
            relaxed.setdefault(key, {})[steps] = structure_of(store, args.cutoff_um, args.bins)
            cpu_s[*key, steps] = cost.cpu_s
            particles[key] = len(store.particles)
    tables = []
    for (surrogate, slurry), by_steps in relaxed.items():
        of_dem = dem_structure[dem_structure.slurry == slurry]
        curve = dem_rdf[(dem_rdf.slurry == slurry) & (dem_rdf.pair == "all")]
        if curve.empty:
            raise InputError(f"slurry {slurry}, DEM: no curve of all particles to compare with")
        density_g_cm3, coordination = (
            one_value(of_dem, quantity, f"slurry {slurry}, DEM") for quantity in ("density_g_cm3", "coordination_all")
        )
        stages = measured[(measured.surrogate == surrogate) & (measured.slurry == slurry)]
        overlap = one_value(
            stages[stages.stage == "predicted"], "overlap_mean", f"surrogate {surrogate}, slurry {slurry}, prediction"
        )
        dem = Structure(density_g_cm3, curve, coordination)
        errors = relaxation_errors(by_steps, dem, particles[surrogate, slurry], noise, replica_curves)
        names = {"surrogate": surrogate, "slurry": slurry, "overlap_mean_predicted": overlap}
        tables.append(errors.assign(**names, cpu_s=[cpu_s[surrogate, slurry, steps] for steps in errors.steps]))
    table = pd.concat(tables)
    write_table(args.table, table, columns=COLUMNS)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
