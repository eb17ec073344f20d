"""How long a prediction has to be relaxed until it cannot be told from another run of the DEM. Pure tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from slurrycast.evaluation.noise import BAND_SDS, Noise, rdf_difference

COLUMNS = (
    *("surrogate", "slurry", "steps", "overlap_mean_predicted", "density_error", "density_in_sd", "rdf_in_spread"),
    *("cpu_s", "within_band"),
)


@dataclass(frozen=True)
class Structure:
    """What counts of a structure: density in g/cm3, and the RDF of all particles (columns r_um, g)."""

    density_g_cm3: float
    curve: pd.DataFrame


def relaxation_errors(
    relaxed: Mapping[int, Structure],
    dem: Structure,
    particles: int,
    noise: Noise,
    replica_curves: Mapping,
    rdf_tolerance: float,
) -> pd.DataFrame:
    """Errors of one prediction after each number of steps in `relaxed`, in order, beside the `dem` of its slurry.

    Columns: steps; density_error, density / density of the DEM - 1; density_in_sd, its size over the standard deviation
    of replicas; rdf_in_spread, the mean |g - g_dem| over the mean difference between two replicas; within_band, whether
    the former is at most BAND_SDS and the latter at most `rdf_tolerance`. All curves count the same bins, those that
    each of them has: the noise of g falls with r. `replica_curves` are those of `Noise.rdf_spread`. A scatter of zero
    is none to measure by: what it divides is NaN then, and not within the band.
    """
    bins = min(len(structure.curve) for structure in (dem, *relaxed.values()))
    spread = noise.rdf_spread("all", particles, replica_curves, bins) or np.nan
    sd_g_cm3 = noise.spread("density_g_cm3", particles) or np.nan
    rows = []
    for steps, structure in sorted(relaxed.items()):
        off_g_cm3 = structure.density_g_cm3 - dem.density_g_cm3
        density_in_sd = abs(off_g_cm3) / sd_g_cm3
        rdf_in_spread = rdf_difference(structure.curve[:bins], dem.curve[:bins]) / spread
        rows.append(
            {
                "steps": steps,
                "density_error": off_g_cm3 / dem.density_g_cm3,
                "density_in_sd": density_in_sd,
                "rdf_in_spread": rdf_in_spread,
                "within_band": bool(density_in_sd <= BAND_SDS and rdf_in_spread <= rdf_tolerance),
            }
        )
    return pd.DataFrame(rows)


def enough_steps(table: pd.DataFrame) -> dict[str, list[int]]:
    """Numbers of steps by surrogate, rising, after which all slurries are within the band; `table` is relaxation.csv.

    They may end before the most that were tried: a prediction that is dense enough only becomes denser with further
    steps, until the DEM's density is left behind.
    """
    found = {}
    for surrogate, own in table.groupby("surrogate", sort=False):
        within = own.groupby("steps").within_band.all().sort_index()
        found[str(surrogate)] = [int(steps) for steps in within.index[within]]
    return found


def mean_errors(table: pd.DataFrame, column: str, surrogates: Sequence[str]) -> pd.DataFrame:
    """Mean of `column` of tables/relaxation.csv over the slurries: surrogates x steps, rising."""
    return table.pivot_table(index="surrogate", columns="steps", values=column, dropna=False).reindex(surrogates)
