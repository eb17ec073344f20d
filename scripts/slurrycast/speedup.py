"""What the hybrid chain costs for one slurry, against the full DEM and against the DEM up to equilibrium."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

# parts of a hybrid run in the order of the workflow: stage in the cost table, name in figures and tables
HYBRID_PARTS = {
    "run_slurry_to_input": "DEM to the last input frame",
    "predict_slurry": "prediction",
    "wrap_slurry": "wrapping",
    "relax_slurry": "relaxation",
}


def dem_seconds(run: Mapping, steps: float, clock: str = "wall_s") -> float:
    """Seconds on `clock` that LAMMPS spent on a DEM run up to step `steps`, push-off and every start included.

    `run` is the content of run.json; a segment that goes on beyond that step counts by its share of steps.
    """
    seconds = run["start"][clock]
    for segment in run["segments"]:
        first, last = segment["step_start"], segment["step_end"]
        seconds += segment[clock] * min(max((steps - first) / (last - first), 0.0), 1.0)
    return seconds


def compare_costs(
    costs: pd.DataFrame, equilibrium: pd.DataFrame, runs: Mapping[str, Mapping], clock: str = "wall_s"
) -> pd.DataFrame:
    """Seconds of each part for every slurry that went through the hybrid chain, in the order of `equilibrium`.

    `costs` is tables/cost.csv, `equilibrium` tables/equilibrium.csv, `runs` the content of run.json by slurry; `clock`
    is wall_s or cpu_s. Columns: surrogate, slurry, clock, particles, one a stage of HYBRID_PARTS, hybrid, dem,
    dem_to_equilibrium, ratio (dem / hybrid), ratio_to_equilibrium. dem and ratio are NaN for slurries of role new,
    whose DEM is not run to the end; dem_to_equilibrium and ratio_to_equilibrium are NaN for these too, and for slurries
    with a warning, which are not in equilibrium at their end.
    """
    rows = []
    relaxations = costs[costs.stage == "relax_slurry"]
    for surrogate in dict.fromkeys(relaxations.surrogate):
        relaxed = set(relaxations.slurry[relaxations.surrogate == surrogate])
        for slurry in equilibrium[equilibrium.slurry.isin(relaxed)].itertuples():
            own = costs[(costs.slurry == slurry.slurry) & costs.surrogate.isin(["-", surrogate])]
            seconds = own.groupby("stage")[clock].sum()
            parts = {stage: float(seconds.get(stage, np.nan)) for stage in HYBRID_PARTS}
            hybrid = sum(parts.values())
            run = runs[slurry.slurry]
            dem = dem_seconds(run, run["steps"], clock) if slurry.role != "new" else np.nan
            to_equilibrium = np.nan
            if not np.isnan(slurry.time_to_equilibrium_us) and not slurry.warning:
                steps = run["steps"] * slurry.time_to_equilibrium_us / slurry.run_time_us
                to_equilibrium = dem_seconds(run, steps, clock)
            rows.append(
                {"surrogate": surrogate, "slurry": slurry.slurry, "clock": clock, "particles": slurry.particles}
                | parts
                | {
                    "hybrid": hybrid,
                    "dem": dem,
                    "dem_to_equilibrium": to_equilibrium,
                    "ratio": dem / hybrid,
                    "ratio_to_equilibrium": to_equilibrium / hybrid,
                }
            )
    return pd.DataFrame(rows)


def time_unit(longest_s: float) -> tuple[float, str]:
    """Seconds in a fitting unit for times up to `longest_s`, and the unit's name."""
    for length_s, name in ((3600.0, "h"), (60.0, "min")):
        if longest_s > 3 * length_s:
            return length_s, name
    return 1.0, "s"
