"""Compare DEM runs of one slurry with several timesteps and seeds: does the end depend on the timestep?

In: run.json, thermo.csv, and quantities and curves (CSV of measure_structure.py) of every run.
Out: a table (CSV) of one row a run: rayleigh_share is timestep / Rayleigh time, rdf_difference the mean |g - g_0| of
the RDF of all pairs over the bins that all runs have, g_0 being a run with the smallest timestep and another seed, and
the mean over these runs; cpu_s that of LAMMPS. And one of one row a timestep: mean and standard deviation (sd,
ddof = 1) over the seeds; <quantity>_difference is the mean over that of the smallest timestep less 1, and
<quantity>_standard_error that of this difference (of the density: density_difference and standard_error). accepted (yes
or no) says whether density_difference is within --max-density-difference; density_difference_bound is
|density_difference| and two standard errors, up to which the seeds do not rule out a difference.
"""

import json

import numpy as np
import pandas as pd

from slurrycast.data.tables import read_table, write_table
from slurrycast.dem.equilibrium import equilibrium
from slurrycast.dem.forcefield import rayleigh_times_us
from slurrycast.dem.recipe import particle_types
from slurrycast.evaluation.noise import mean_and_sd, rdf_difference
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

MEASURED = ("density_g_cm3", "coordination_all", "overlap_mean", "overlap_max")
QUANTITIES = (*MEASURED, "rdf_difference", "time_to_equilibrium_us", "cpu_s")
# whose difference from the smallest timestep is tabulated: names of its column and of that of its standard error
DIFFERENCES = {
    "density_g_cm3": ("density_difference", "standard_error"),
    **{
        quantity: (f"{quantity}_difference", f"{quantity}_standard_error")
        for quantity in ("coordination_all", "overlap_mean", "time_to_equilibrium_us")
    },
}
RESOLVED_STANDARD_ERRORS = 2


def run_row(run: dict, thermo: pd.DataFrame, structure: pd.DataFrame) -> dict:
    """Row of one run, but for the RDF."""
    physics = run["physics"]
    timestep_us = physics["dem"]["timestep_us"]
    types = particle_types(physics["formulation"]["phases"])
    rayleigh_us = min(rayleigh_times_us(types, physics["force_field"]).values())
    values = structure.set_index("quantity").value
    end = equilibrium(thermo.time_us.to_numpy(), thermo.density_g_cm3.to_numpy())
    return {
        "slurry": run["slurry"],
        "timestep_us": timestep_us,
        "seed": physics["slurry"]["seed"],
        "rayleigh_share": timestep_us / rayleigh_us,
        **{quantity: values[quantity] for quantity in MEASURED},
        "time_to_equilibrium_us": end.time_to_equilibrium_us,
        "cpu_s": run["start"]["cpu_s"] + sum(segment["cpu_s"] for segment in run["segments"]),
    }


def rdf_differences(timesteps_us: list[float], seeds: list[int], curves: list[pd.DataFrame]) -> list[float]:
    """Mean difference of each curve from those of the smallest timestep with other seeds; NaN if there are none.

    The same for all timesteps: a run and one of the same seed start alike, and no run is compared with itself.
    """
    bins = min(map(len, curves))
    smallest = [i for i, timestep_us in enumerate(timesteps_us) if timestep_us == min(timesteps_us)]
    differences = []
    for seed, curve in zip(seeds, curves, strict=True):
        others = [rdf_difference(curve[:bins], curves[i][:bins]) for i in smallest if seeds[i] != seed]
        differences.append(float(np.mean(others)) if others else np.nan)
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
    for row in rows:
        for quantity, (difference, standard_error) in DIFFERENCES.items():
            reference = smallest[f"{quantity}_mean"] or np.nan  # no share of nothing, such as no overlap
            variances = [r[f"{quantity}_sd"] ** 2 / r["runs"] for r in (row, smallest)]
            row[difference] = row[f"{quantity}_mean"] / reference - 1
            row[standard_error] = np.sqrt(sum(variances)) / reference if row is not smallest else 0.0
        change = abs(row["density_difference"])
        row["density_difference_bound"] = change + RESOLVED_STANDARD_ERRORS * row["standard_error"]
        row["accepted"] = "yes" if change <= max_density_difference else "no"
    return pd.DataFrame(rows)


def in_words(row: pd.Series, max_density_difference: float) -> str:
    """One line on a row of the summary that is not the smallest timestep's: what is accepted, and what is resolved."""
    resolved, unresolved = [], []
    for quantity, (difference, standard_error) in DIFFERENCES.items():
        text = f"{quantity} {100 * row[difference]:+.2f} % +- {100 * row[standard_error]:.2f} %"
        # Without a second seed there is no standard error, and nothing is resolved.
        (resolved if abs(row[difference]) > RESOLVED_STANDARD_ERRORS * row[standard_error] else unresolved).append(text)
    bound = row["density_difference_bound"]
    if np.isnan(bound):
        known = "one seed says nothing of the scatter"
    else:
        known = f"the difference is below {100 * bound:.2f} % at {RESOLVED_STANDARD_ERRORS} standard errors"
        if bound > max_density_difference >= abs(row["density_difference"]):
            known += f", so not shown to be within {100 * max_density_difference:g} %"
    return (
        f"{row['timestep_us']:g} us: density accepted: {row['accepted']}, {known}; "
        f"differs from the smallest timestep in: {', '.join(resolved) or 'nothing resolved'}; "
        f"not resolved: {', '.join(unresolved) or 'nothing'}"
    )


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--run-json", "run.json of every run", nargs="+")
    parser.add_input("--thermo", "thermo.csv of the same, in order", nargs="+")
    parser.add_input("--structure", "quantities of the same (CSV)", nargs="+")
    parser.add_input("--rdf", "curves of the same (CSV)", nargs="+")
    meaning = "share of the density at the smallest timestep within which another timestep is accepted"
    parser.add_value("--max-density-difference", meaning, type=float)
    parser.add_output("--runs", "table of all runs (CSV)")
    parser.add_output("--summary", "table of the timesteps (CSV)")
    parser.as_many_of_each("run_json", "thermo", "structure", "rdf")


def main(args: Namespace) -> None:
    """Compare and write both tables."""
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
    runs.insert(column, "rdf_difference", rdf_differences(runs.timestep_us.to_list(), runs.seed.to_list(), curves))
    runs = runs.sort_values(["timestep_us", "seed"])
    by_timestep = summary(runs, args.max_density_difference)
    for table, path in ((runs, args.runs), (by_timestep, args.summary)):
        write_table(path, table)
    for _, row in by_timestep[1:].iterrows():
        print(in_words(row, args.max_density_difference))


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
