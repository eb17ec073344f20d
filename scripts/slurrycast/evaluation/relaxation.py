"""How long a prediction must be relaxed until it looks like another run of the DEM. Pure tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from slurrycast.evaluation.noise import BAND_SDS, Noise, rdf_difference
from slurrycast.evaluation.verdicts import RDF_BAND

# The largest error of each kind that counts as reached.
BANDS = {"density_in_sd": BAND_SDS, "rdf_in_spread": RDF_BAND, "coordination_in_sd": BAND_SDS}
COLUMNS = (
    *("surrogate", "slurry", "steps", "overlap_mean_predicted", "density_error", "density_in_sd", "rdf_in_spread"),
    *("coordination_in_sd", "cpu_s", "within_band"),
)


@dataclass(frozen=True)
class Structure:
    """What is compared of a structure: density, RDF of all particles (columns r_um, g), and contacts of a particle."""

    density_g_cm3: float
    curve: pd.DataFrame
    coordination: float


def relaxation_errors(
    relaxed: Mapping[int, Structure],
    dem: Structure,
    particles: int,
    noise: Noise,
    replica_curves: Mapping,
) -> pd.DataFrame:
    """Errors of one prediction after relaxations of several lengths, beside the DEM of its slurry.

    Parameters
    ----------
    relaxed
        Structure after each number of steps.
    dem, particles
        End of the DEM, and its number of particles.
    noise, replica_curves
        Noise of the DEM, and curves of replicas as `Noise.rdf_spread` takes them.

    Returns
    -------
    One row for each number of steps, rising, with the columns steps; density_error, density / density of the DEM - 1;
    density_in_sd and coordination_in_sd, the size of the difference over the standard deviation of replicas;
    rdf_in_spread, the mean |g - g_dem| over the mean difference between two replicas; and within_band, whether the
    former are at most BAND_SDS and the latter at most RDF_BAND.

    Notes
    -----
    All curves are cut to the bins that each of them has, because the noise of g falls with r. A scatter of zero is no
    unit: the quotient is NaN then, and not within the band.
    """
    bins = min(len(structure.curve) for structure in (dem, *relaxed.values()))
    spread = noise.rdf_spread("all", particles, replica_curves, bins) or np.nan
    structures = [structure for _, structure in sorted(relaxed.items())]
    off_g_cm3 = pd.Series([structure.density_g_cm3 - dem.density_g_cm3 for structure in structures])
    off_contacts = pd.Series([structure.coordination - dem.coordination for structure in structures])
    differences = [rdf_difference(structure.curve[:bins], dem.curve[:bins]) for structure in structures]
    table = pd.DataFrame({"steps": sorted(relaxed), "density_error": off_g_cm3 / dem.density_g_cm3})
    table["density_in_sd"] = off_g_cm3.abs() / (noise.spread("density_g_cm3", particles) or np.nan)
    table["rdf_in_spread"] = np.array(differences) / spread
    table["coordination_in_sd"] = off_contacts.abs() / (noise.spread("coordination_all", particles) or np.nan)
    return table.assign(within_band=(table[list(BANDS)] <= pd.Series(BANDS)).all(axis=1))


def enough_steps(table: pd.DataFrame) -> dict[str, list[int]]:
    """Numbers of steps by surrogate, rising, after which all slurries are within the band; `table` is relaxation.csv.

    The largest number tried need not be among them: each step makes a prediction denser, until it leaves the density
    of the DEM behind.
    """
    enough = {}
    for surrogate, rows in table.groupby("surrogate", sort=False):
        within = rows.groupby("steps").within_band.all().sort_index()
        enough[str(surrogate)] = [int(steps) for steps in within.index[within]]
    return enough


def mean_errors(table: pd.DataFrame, column: str, surrogates: Sequence[str]) -> pd.DataFrame:
    """Mean of `column` of tables/relaxation.csv over the slurries: surrogates x steps, rising."""
    return table.pivot_table(index="surrogate", columns="steps", values=column, dropna=False).reindex(surrogates)
