"""Compare DEM runs of one slurry with several timesteps and seeds: does the end depend on the timestep?

In: run.json, thermo.csv, and quantities and curves (CSV of measure_structure.py) of every run.
Out: a table (CSV) of one row a run: rayleigh_share is timestep / Rayleigh time, rdf_difference the mean |g - g_0| of
the RDF of all pairs, with g_0 the mean of the runs with the smallest timestep (of the others, for one of those itself),
cpu_s that of LAMMPS. And one of one row a timestep: mean and standard deviation (sd, ddof = 1) over the seeds;
density_difference is the mean density over that of the smallest timestep less 1, standard_error that of this
difference, and accepted (yes or no) says whether it is within --max-density-difference.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import pandas as pd

from slurrycast.costs import measured_cost
from slurrycast.equilibrium import equilibrium
from slurrycast.files import InputError, run_main, write_text
from slurrycast.forcefield import rayleigh_time_us
from slurrycast.noise import mean_and_sd, rdf_difference
from slurrycast.recipe import particle_types
from slurrycast.tables import read_table

MEASURED = ("density_g_cm3", "coordination_all", "overlap_mean", "overlap_max")
QUANTITIES = (*MEASURED, "rdf_difference", "time_to_equilibrium_us", "cpu_s")


def run_row(run: dict, thermo: pd.DataFrame, structure: pd.DataFrame) -> dict:
    """Row of one run, but for the RDF."""
    physics = run["physics"]
    timestep_us = physics["dem"]["timestep_us"]
    stiffness_kpa = physics["force_field"]["granular_hertz"]["normal_stiffness_kpa"]
    values = structure.set_index("quantity").value
    return {
        "slurry": run["slurry"],
        "timestep_us": timestep_us,
        "seed": physics["slurry"]["seed"],
        "rayleigh_share": timestep_us
        / rayleigh_time_us(particle_types(physics["formulation"]["phases"]), stiffness_kpa),
        **{quantity: values[quantity] for quantity in MEASURED},
        "time_to_equilibrium_us": equilibrium(
            thermo.time_us.to_numpy(), thermo.density_g_cm3.to_numpy()
        ).time_to_equilibrium_us,
        "cpu_s": run["start"]["cpu_s"] + sum(segment["cpu_s"] for segment in run["segments"]),
    }


def mean_curve(curves: list[pd.DataFrame]) -> pd.DataFrame:
    """Mean of curves (columns r_um, g) over the bins that all have."""
    bins = min(len(curve) for curve in curves)
    return pd.DataFrame({"r_um": curves[0].r_um[:bins], "g": np.mean([curve.g[:bins] for curve in curves], axis=0)})


def rdf_differences(timesteps_us: list[float], curves: list[pd.DataFrame]) -> list[float]:
    """Difference of each curve from the mean of those of the smallest timestep but itself; NaN if none is left."""
    smallest = min(timesteps_us)
    differences = []
    for own, curve in enumerate(curves):
        others = [c for i, c in enumerate(curves) if timesteps_us[i] == smallest and i != own]
        differences.append(rdf_difference(curve, mean_curve(others)) if others else np.nan)
    return differences


def summary(runs: pd.DataFrame, max_density_difference: float) -> pd.DataFrame:
    """One row a timestep, the smallest one first, from the table of the runs."""
    rows = []
    for timestep_us, of_step in runs.groupby("timestep_us"):
        row = {"timestep_us": timestep_us, "rayleigh_share": of_step.rayleigh_share.iloc[0], "runs": len(of_step)}
        for quantity in QUANTITIES:
            row[f"{quantity}_mean"], row[f"{quantity}_sd"] = mean_and_sd(of_step[quantity])
        rows.append(row)
    smallest = rows[0]
    reference = smallest["density_g_cm3_mean"]
    for row in rows:
        row["density_difference"] = row["density_g_cm3_mean"] / reference - 1
        variances = [r["density_g_cm3_sd"] ** 2 / r["runs"] for r in (row, smallest)]
        row["standard_error"] = np.sqrt(sum(variances)) / reference if row is not smallest else 0.0
        row["accepted"] = "yes" if abs(row["density_difference"]) <= max_density_difference else "no"
    return pd.DataFrame(rows)


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run-json", type=Path, nargs="+", required=True, help="in: run.json of every run")
    parser.add_argument("--thermo", type=Path, nargs="+", required=True, help="in: thermo.csv of the same, in order")
    parser.add_argument("--structure", type=Path, nargs="+", required=True, help="in: quantities of the same (CSV)")
    parser.add_argument("--rdf", type=Path, nargs="+", required=True, help="in: curves of the same (CSV)")
    parser.add_argument(
        "--max-density-difference",
        type=float,
        required=True,
        help="share of the density at the smallest timestep within which another timestep is accepted",
    )
    parser.add_argument("--runs", type=Path, required=True, help="out: table of all runs (CSV)")
    parser.add_argument("--summary", type=Path, required=True, help="out: table of the timesteps (CSV)")
    parser.add_argument("--cost", type=Path, required=True, help="out: cost record (JSON)")
    args = parser.parse_args()
    if not len(args.run_json) == len(args.thermo) == len(args.structure) == len(args.rdf):
        parser.error("--run-json, --thermo, --structure and --rdf: as many of each are needed")
    return args


def main() -> None:
    """Compare and write both tables."""
    args = parse_args()
    with measured_cost(args.cost, "compare_timesteps"):
        rows, curves, wanted = [], [], None
        for run_path, *paths in zip(args.run_json, args.thermo, args.structure, args.rdf, strict=True):
            run = json.loads(run_path.read_text(encoding="utf-8"))
            thermo, structure, rdf = map(read_table, paths)
            rows.append(run_row(run, thermo, structure))
            curves.append(rdf[rdf.pair == "all"].reset_index(drop=True))
            mass_and_shape = {key: value for key, value in run["physics"]["slurry"].items() if key != "seed"}
            if mass_and_shape != (wanted := wanted or mass_and_shape):
                raise InputError(f"{run_path}: {mass_and_shape} in place of {wanted}: runs must differ in seed only")
        runs = pd.DataFrame(rows)
        column = list(runs.columns).index("time_to_equilibrium_us")
        runs.insert(column, "rdf_difference", rdf_differences(runs.timestep_us.to_list(), curves))
        runs = runs.sort_values(["timestep_us", "seed"])
        by_timestep = summary(runs, args.max_density_difference)
        for table, path in ((runs, args.runs), (by_timestep, args.summary)):
            write_text(path, table.to_csv(index=False, float_format="%.9g"))
    for row in by_timestep.itertuples():
        print(
            f"{row.timestep_us:g} us: density {100 * row.density_difference:+.2f} % "
            f"+- {100 * row.standard_error:.2f} % from the smallest timestep, accepted: {row.accepted}"
        )


if __name__ == "__main__":
    run_main(main)
