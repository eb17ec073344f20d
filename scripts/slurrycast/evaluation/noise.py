"""Noise of the DEM itself, the unit of errors: spread of replicas, floor of perturbed runs, and the skill.

Replicas are DEM runs of one slurry with other seeds; a perturbed run is a DEM run continued from the last input frame
with positions displaced by a tiny length. Both exist for a few slurries. For all sizes, the scatter of all replicas is
pooled and scaled; the floor is that of the nearest size.
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
        Errors of the prediction and of the affine map, and the floor: the error of one perturbed run of the DEM.

    Returns
    -------
    0 for a prediction as good as the affine map, negative for a worse one, 1 for one as near as a perturbed run; NaN if
    the affine map itself is as near.

    Notes
    -----
    Skill can exceed 1. Two runs of an ensemble scatter about its mean, so the mean is nearer to each of them than they
    are to each other: its MSE is half the floor if they are independent.
    """
    room_um2 = mse_affine_um2 - floor_um2
    return 1 - (mse_um2 - floor_um2) / room_um2 if room_um2 > 0 else np.nan


@dataclass(frozen=True)
class Noise:
    """tables/noise.csv, and what follows from it for slurries of any size."""

    path: Path
    table: pd.DataFrame

    def spread(self, quantity: str, particles: int) -> float:
        """Standard deviation of a quantity between DEM runs with other seeds.

        Parameters
        ----------
        quantity
            Any but an RDF, whose noise depends on the bins that are compared: `rdf_spread`.
        particles
            Number of particles of the slurry.

        Returns
        -------
        Standard deviation; NaN where no two replicas of a slurry have the quantity, such as windows too large for them.

        Notes
        -----
        The scatter falls with particles^-1/2, so variance x particles is one quantity, of which each replicated slurry
        is an estimate. It is pooled: the mean weighted by degrees of freedom, which are the runs less one.
        """
        rows = self.table[(self.table.quantity == quantity) & self.table.sd.notna()]
        if rows.empty:
            return np.nan
        variance = np.average(rows.particles * rows.sd**2, weights=rows.runs - 1)
        return float(np.sqrt(variance / particles))

    def rdf_spread(self, pair: str, particles: int, replica_curves: Mapping, bins: int) -> float:
        """Mean difference of g(r) of a pair between two DEM runs of one slurry.

        Parameters
        ----------
        pair, particles
            Name of the pair, and the number of particles of the slurry.
        replica_curves
            Curves (columns r_um, g) of all replicas by (replicated slurry, pair).
        bins
            Number of bins from r = 0 that are compared. The mean in the table is over another range: noise falls with
            r, as shells hold more particles.

        Raises
        ------
        InputError
            If no slurry of the table has two curves of the pair.

        Notes
        -----
        Pooled like `spread`, difference x particles^1/2, over the replicated slurries whose curves have all `bins`;
        where none has, over those that reach farthest.
        """
        sizes = self.table.drop_duplicates("slurry").set_index("slurry").particles
        known = {
            slurry: curves
            for (slurry, of), curves in replica_curves.items()
            if of == pair and slurry in sizes and len(curves) > 1
        }
        if not known:
            raise InputError(f"RDF {pair}: no slurry with the curves of two replicas")
        reach = {slurry: min(bins, *map(len, curves)) for slurry, curves in known.items()}
        chosen = [slurry for slurry in known if reach[slurry] == max(reach.values())]
        scaled = [
            rdf_spread([curve[: reach[slurry]] for curve in known[slurry]])[0] * np.sqrt(sizes[slurry])
            for slurry in chosen
        ]
        runs = np.array([len(known[slurry]) for slurry in chosen])
        return float(np.average(scaled, weights=runs - 1) / np.sqrt(particles))

    def floor_um2(self, particles: int) -> float:
        """Floor of the MSE (um2): that of the slurry nearest in log(particles), the first of two equally near ones.

        It is the deviation of one perturbed run, not the least that is possible: see `skill`. InputError if the table
        has no floor.
        """
        rows = self.table[self.table.quantity == FLOOR]
        if rows.empty:
            raise InputError(f"{self.path}: no {FLOOR}, needed is one of one slurry at least")
        return float(rows["mean"].loc[np.abs(np.log(rows.particles / particles)).idxmin()])


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
