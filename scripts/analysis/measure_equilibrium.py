"""Measure how far each DEM slurry has come: density, contacts and motion at its end, and whether it is in equilibrium.

In: run.json and thermo.csv of every slurry that has a DEM.
Out: a table (CSV) of one row a slurry: density_drift is the relative change of density over the last 10 % of the run,
with a warning where it exceeds the bound; drift and time_to_equilibrium_us are empty for a run that ends at the last
input frame (role new), and so is the warning. temperature_densifying_k is that of translation, its mean until the
density is 99 % of its last value; temperature_k, of translation, temperature_rotational_k and kinetic_share, the
kinetic energy over pressure x volume, are those of the last row.
"""

import json
import sys

import pandas as pd

from slurrycast.analysis.temperatures import densifying, kinetic_share
from slurrycast.data.tables import read_table, write_table
from slurrycast.dem.equilibrium import equilibrium
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost

COLUMNS = ("slurry", "role", "mass_units", "thickness_ratio", "particles", "density_g_cm3", "mean_contacts")
COLUMNS += ("density_drift", "time_to_equilibrium_us", "temperature_densifying_k", "temperature_k")
COLUMNS += ("temperature_rotational_k", "kinetic_share", "run_time_us", "warning")


def equilibrium_row(run: dict, thermo: pd.DataFrame, role: str, max_density_drift: float) -> dict:
    """Row of the table for one slurry, from its run.json and thermo.csv."""
    row, end = run["physics"]["slurry"], thermo.iloc[-1]
    drift = time_us = None
    warning = ""
    if role != "new":
        end_of_run = equilibrium(thermo["time_us"].to_numpy(), thermo["density_g_cm3"].to_numpy())
        drift, time_us = end_of_run.density_drift, end_of_run.time_to_equilibrium_us
        if abs(drift) > max_density_drift:
            warning = (
                f"not in equilibrium: density changed by {100 * drift:+.3g} % over the last 10 % of the run, "
                f"at most {100 * max_density_drift:.3g} % is allowed"
            )
    return {
        "slurry": run["slurry"],
        "role": role,
        "mass_units": row["mass_units"],
        "thickness_ratio": row["thickness_ratio"],
        "particles": run["particles"],
        "density_g_cm3": end["density_g_cm3"],
        "mean_contacts": end["mean_contacts"],
        "density_drift": drift,
        "time_to_equilibrium_us": time_us,
        "temperature_densifying_k": densifying(thermo).temperature_k.mean(),
        "temperature_k": end["temperature_k"],
        "temperature_rotational_k": end["temperature_rotational_k"],
        "kinetic_share": kinetic_share(end, run["particles"], run["physics"]["dem"]["pressure_kpa"]),
        "run_time_us": end["time_us"],
        "warning": warning,
    }


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--run-json", "run.json of every slurry, none where nothing is simulated", nargs="*")
    parser.add_input("--thermo", "thermo.csv of the same, in order", nargs="*")
    parser.add_value("--roles", "train, validation, test or new; in the same order", nargs="*", default=[])
    parser.add_value("--max-density-drift", "relative drift above which to warn", type=float)
    parser.add_output("--table", "table of all slurries (CSV)")
    parser.add_output("--cost", "cost record (JSON)")
    parser.as_many_of_each("run_json", "thermo", "roles")


def main(args: Namespace) -> None:
    """Measure all slurries and write the table; warnings go to stderr too."""
    with measured_cost(args.cost, "measure_equilibrium"):
        rows = []
        for run_path, thermo_path, role in zip(args.run_json, args.thermo, args.roles, strict=True):
            run, thermo = json.loads(run_path.read_text(encoding="utf-8")), read_table(thermo_path)
            rows.append(equilibrium_row(run, thermo, role, args.max_density_drift))
            if rows[-1]["warning"]:
                print(f"warning: slurry {run['slurry']}: {rows[-1]['warning']}", file=sys.stderr)
        write_table(args.table, rows, columns=COLUMNS)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
