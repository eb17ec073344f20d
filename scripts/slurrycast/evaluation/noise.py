"""Noise of the DEM itself, the unit of errors: spread of replicas, floor of perturbed runs, and the skill.

Replicas are DEM runs of one slurry with other seeds; a perturbed run is a DEM run continued from the last input frame
with positions displaced by a tiny length. Both exist for a few slurries; other sizes are scaled from the nearest one.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd

from slurrycast.analysis.errors import deviation_um
from slurrycast.analysis.rdf import mean_absolute_difference
from slurrycast.data.frames import FrameStore
from slurrycast.data.tables import read_table
from slurrycast.runtime.files import InputError

FLOOR = "perturbation_floor_um2"
RDF_PREFIX = "rdf_"
COLUMNS = ("slurry", "particles", "quantity", "runs", "mean", "sd")
BAND_SDS = 2
_REPLICA = re.compile(r"(?P<slurry>.+)_r\d+")


def replicated_slurry(replica: str) -> str:
    """Id of the slurry that `replica` repeats: `6` of `6_r1`. InputError if it is none."""
    match = _REPLICA.fullmatch(replica)
    if match is None:
        raise InputError(f"slurry {replica}: not a replica, their ids are <slurry>_r<number>")
    return match["slurry"]


def mean_and_sd(values: Sequence[float]) -> tuple[float, float]:
    """Mean and standard deviation of a sample (ddof = 1), which is NaN of a single value."""
    return float(np.mean(values)), float(np.std(values, ddof=1)) if len(values) > 1 else np.nan


def rdf_difference(a: pd.DataFrame, b: pd.DataFrame) -> float:
    """Mean of |g_a - g_b| over the bins that both curves have.

    Parameters
    ----------
    a, b
        Curves (columns r_um, g) from r = 0.

    Raises
    ------
    InputError
        If their bins are not equally wide.
    """
    bins = min(len(a), len(b))
    if bins == 0 or not np.allclose(a["r_um"][:bins], b["r_um"][:bins], rtol=1e-6):
        raise InputError("RDF curves with bins of different width: compute both with the same cutoff and bins")
    return mean_absolute_difference(a["g"].to_numpy()[:bins], b["g"].to_numpy()[:bins])


def rdf_spread(curves: Sequence[pd.DataFrame]) -> tuple[float, float]:
    """Mean and standard deviation, over all pairs of `curves` (columns r_um, g), of their `rdf_difference`.

    All are cut to the range of the shortest one first, so that every pair counts the same bins.
    """
    bins = min(len(curve) for curve in curves)
    return mean_and_sd([rdf_difference(a[:bins], b[:bins]) for a, b in combinations(curves, 2)])


def final_deviation_um(structure: FrameStore, dem: FrameStore, frame: int) -> np.ndarray:
    """Deviation of the end of a structure from a frame of the DEM, as `errors.deviation_um`.

    Parameters
    ----------
    structure
        Frame store whose last frame is compared.
    dem, frame
        Frame store of the DEM, and the number of its frame.

    Returns
    -------
    Deviation (n, 3) in um.

    Raises
    ------
    InputError
        If the particles are not the same.
    """
    structure.check_same_particles(dem)
    return deviation_um(dem.position_um(frame), structure.position_um(structure.last))


def final_mse_um2(structure: FrameStore, dem: FrameStore, frame: int) -> float:
    """Mean over particles and axes of the squared `final_deviation_um`, um2."""
    return float(np.mean(final_deviation_um(structure, dem, frame) ** 2))


def skill(mse_um2: float, mse_affine_um2: float, floor_um2: float) -> float:
    """Skill of a prediction: 1 - (MSE - floor) / (MSE of affine - floor).

    Parameters
    ----------
    mse_um2, mse_affine_um2, floor_um2
        Errors of the prediction and of the affine map, and the floor that the DEM itself sets.

    Returns
    -------
    0 for a prediction as good as the affine map, negative for a worse one, 1 at the floor; NaN if the affine map itself
    is at the floor.
    """
    room_um2 = mse_affine_um2 - floor_um2
    return 1 - (mse_um2 - floor_um2) / room_um2 if room_um2 > 0 else np.nan


@dataclass(frozen=True)
class Noise:
    """tables/noise.csv, and what follows from it for slurries of any size."""

    path: Path
    table: pd.DataFrame

    def _nearest(self, quantity: str, particles: int) -> pd.Series:
        """Row of the slurry nearest in log(particles); the first one of two that are equally near."""
        rows = self.table[self.table.quantity == quantity]
        if rows.empty:
            raise InputError(f"{self.path}: no {quantity}, the noise is needed of one slurry at least")
        return rows.loc[np.abs(np.log(rows.particles / particles)).idxmin()]

    def spread(self, quantity: str, particles: int) -> float:
        """Standard deviation of a quantity between DEM runs with other seeds, scaled with particles^-1/2.

        Parameters
        ----------
        quantity
            Any but an RDF, whose noise depends on the bins that are compared: `rdf_spread`.
        particles
            Number of particles of the slurry.
        """
        row = self._nearest(quantity, particles)
        return float(row["sd"] * np.sqrt(row["particles"] / particles))

    def rdf_spread(self, pair: str, particles: int, replica_curves: Mapping, bins: int) -> float:
        """Mean difference of g(r) of a pair between two DEM runs of one slurry.

        Parameters
        ----------
        pair, particles
            Name of the pair, and the number of particles of the slurry.
        replica_curves
            Curves (columns r_um, g) of all replicas by (replicated slurry, pair). Those of the nearest size are
            taken and scaled with particles^-1/2.
        bins
            Number of bins from r = 0 that are compared, as far as the replicas reach. The mean in the table is over
            another range: noise falls with r, as shells hold more particles.

        Raises
        ------
        InputError
            If there are less than two curves.
        """
        row = self._nearest(f"{RDF_PREFIX}{pair}", particles)
        curves = replica_curves.get((row["slurry"], pair), [])
        if len(curves) < 2:
            raise InputError(f"slurry {row['slurry']}: RDF {pair} of {len(curves)} replicas, needed are two or more")
        return float(rdf_spread([curve[:bins] for curve in curves])[0] * np.sqrt(row["particles"] / particles))

    def floor_um2(self, particles: int) -> float:
        """Floor of the MSE (um2), that of the nearer slurry as it is."""
        return float(self._nearest(FLOOR, particles)["mean"])


def curves_of_replicas(curves: pd.DataFrame) -> dict[tuple[str, str], list[pd.DataFrame]]:
    """Curves (columns r_um, g) of replicas by (replicated slurry, pair), of a table of many (slurry, pair, r_um, g).

    InputError if there are others than of replicas.
    """
    by_slurry_and_pair = {}
    for (replica, pair), curve in curves.groupby(["slurry", "pair"], sort=False):
        by_slurry_and_pair.setdefault((replicated_slurry(replica), pair), []).append(curve)
    return by_slurry_and_pair


def read_noise(path: str | Path) -> Noise:
    """Read tables/noise.csv. InputError if columns are missing."""
    table = read_table(path)
    if missing := set(COLUMNS) - set(table.columns):
        raise InputError(f"{path}: no column {', '.join(sorted(missing))}, needed are {', '.join(COLUMNS)}")
    return Noise(Path(path), table)
