"""What counts as inside the noise of the DEM, and as better or worse: the one definition for all comparisons.

A structure, or whatever else a table of errors measures, is judged over slurries, in units of the scatter of DEM runs
with other seeds (`judge`). Two surrogates are compared by their errors on the same slurries (`compare`).
"""

from collections.abc import Hashable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from slurrycast.evaluation.noise import BAND_SDS, RDF_PREFIX

CONFIDENCE = 0.9  # of the interval of a mean difference
FAMILY_LEVEL = 1 - CONFIDENCE  # probability of any false "differs" or "better" among tests that belong together
FEWEST_TO_JUDGE = 3
EQUIVALENT, DIFFERS, NOT_RESOLVED = "equivalent", "differs", "not resolved"
# What is judged, in groups by how the quantity begins. The packing fractions say the same as the density again, and the
# largest overlap is that of a single contact.
MEASURES = {
    "density": "density_",
    "RDF": RDF_PREFIX,
    "coordination": "coordination_",
    "few contacts": "share_below_",
    "overlap": "overlap_mean",
    "coarseness": "coarseness_",
}
# The same of tapes. Other shares and densities, and the ceramic share of a random mixture, follow from these; a tape is
# crossed through its thickness.
TAPE_MEASURES = {
    "green density": "green_density",
    "shrinkage": "shrinkage",
    "void": "share_void_union",
    "coordination": "coordination_",
    "contacts per volume": "contacts_",
    "percolation": "percolation_",
    "pore size": "pore_size_",
    "mixing": "ceramic_share_sd_",
    "tortuosity": "tortuosity_",
}
_NOT_OF_TAPES = r"percolation_.*_[xy]|ceramic_share_sd_random_.*"
# The largest RDF difference whose systematic part is within the band, in mean differences between two replicas.
RDF_BAND = float(np.sqrt(1 + BAND_SDS**2 / 2))
COLUMNS = ("surrogate", "measure", "slurries", "mean_in_sd", "lower_in_sd", "upper_in_sd", "p", "p_holm", "verdict")


class Mean(NamedTuple):
    """A mean of differences: their number, the mean, its interval, and the p value of the t test that it is zero."""

    number: int
    mean: float
    lower: float
    upper: float
    p: float


def mean_difference(differences: Sequence[float]) -> Mean:
    """Mean of `differences` (n,) that are known, with the two-sided Student interval of `CONFIDENCE`.

    NaN but for the number where there are fewer than `FEWEST_TO_JUDGE`. Differences without scatter have an interval of
    no width.
    """
    from scipy.stats import t

    known = np.asarray(differences, dtype=float)
    known = known[~np.isnan(known)]
    if len(known) < FEWEST_TO_JUDGE:
        return Mean(len(known), *[np.nan] * 4)
    mean, error, freedom = known.mean(), known.std(ddof=1) / np.sqrt(len(known)), len(known) - 1
    half = t.ppf((1 + CONFIDENCE) / 2, freedom) * error
    p = 2 * t.sf(abs(mean) / error, freedom) if error > 0 else float(mean == 0)
    return Mean(len(known), float(mean), float(mean - half), float(mean + half), float(p))


def holm(p: Sequence[float]) -> np.ndarray:
    """Holm's adjusted p values (n,), each to be held against the level of the whole family.

    The smallest of n values is multiplied by n, the next by n - 1 and so on; none falls below one before it, or exceeds
    1 (Holm, Scand. J. Statist. 6, 65, 1979). NaN, where nothing was tested, stays NaN and does not count.
    """
    p = np.asarray(p, dtype=float)
    rising = np.argsort(p, kind="stable")[: np.sum(~np.isnan(p))]  # NaN comes last
    adjusted = np.full(len(p), np.nan)
    adjusted[rising] = np.minimum(np.maximum.accumulate(p[rising] * np.arange(len(rising), 0, -1)), 1)
    return adjusted


def in_noise(errors: pd.DataFrame) -> pd.Series:
    """Differences from the DEM in units of its noise, for rows of tables/structure_errors.csv.

    (value - dem_value) / replica_sd; NaN where the noise is zero or not known. An RDF has no value but a distance, the
    mean |g - g_dem| over its bins, which two runs of the DEM have too: their mean is its replica_sd. A structure that
    differs from the DEM by b(r) beside the noise has a larger one. If b and the noise are normal over the bins,

        (distance / distance of replicas)^2 = 1 + b^2 / (2 sd^2)

    with the mean squares of b and of the noise of one run. So b^2 / sd^2 = 2 ((value / replica_sd)^2 - 1) is what is
    returned for an RDF: zero on average for another run of the DEM, and 4 for a curve that is off by 2 replica sd. The
    scatter of the distances themselves would be no unit: over so many bins it is a few percent of their mean, so that
    the error of this mean, which comes from few replicas, would decide.
    """
    noise = errors.replica_sd.where(errors.replica_sd > 0)
    squared = 2 * ((errors.value / noise) ** 2 - 1)
    return ((errors.value - errors.dem_value) / noise).where(~errors.quantity.str.startswith(RDF_PREFIX), squared)


def judge(errors: pd.DataFrame) -> pd.DataFrame:
    """Whether each surrogate is inside the noise of the DEM in each measure.

    Each surrogate is a question of its own, whether its structure differs from the DEM's, and a row of the figure. So
    its measures are one family of tests, and how many other surrogates are judged does not matter.

    Parameters
    ----------
    errors
        Columns surrogate, slurry, quantity, value, dem_value, replica_sd, as in tables/structure_errors.csv: one row a
        surrogate, measure and slurry, and only what is to be judged.

    Returns
    -------
    Rows of tables/verdicts.csv, one a surrogate and measure. Of the mean of `in_noise` over the slurries: its number of
    slurries, value, interval and p value; of an RDF the roots of mean and interval, with their sign, so that all are in
    replica sd. `p_holm` is corrected by `holm` over the measures of the surrogate.

    Notes
    -----
    "equivalent"    the interval lies within +- BAND_SDS replica sd. So a difference that is resolved, but inside the
                    band, is equivalent. An interval of 90 % makes this a pair of one-sided tests at 5 %. It is not
                    corrected: equivalent in all measures takes every one of these tests.
    "differs"       not equivalent, and p_holm is below `FAMILY_LEVEL`, so that a surrogate like the DEM differs in any
                    measure with at most this probability. Without the correction, this would say that the interval
                    leaves zero out.
    "not resolved"  neither: the slurries are too few or scatter too much. This is no pass.

    The verdict is missing for fewer than `FEWEST_TO_JUDGE` slurries. An RDF cannot differ by being nearer to the DEM
    than a replica is: its b^2 is at least -2, so an interval below zero is inside the band.
    """
    keys = ["surrogate", "quantity"]
    groups = errors.assign(difference=in_noise(errors)).groupby(keys, sort=False).difference
    table = pd.DataFrame([(*key, *mean_difference(group)) for key, group in groups], columns=COLUMNS[:7])
    of_rdf = table.measure.str.startswith(RDF_PREFIX).to_numpy(dtype=bool)
    for column in ("mean_in_sd", "lower_in_sd", "upper_in_sd"):
        values = table[column].to_numpy(dtype=float)
        table[column] = np.where(of_rdf, np.sign(values) * np.sqrt(np.abs(values)), values)
    table["p_holm"] = table.groupby("surrogate").p.transform(holm)
    inside = (table.lower_in_sd >= -BAND_SDS) & (table.upper_in_sd <= BAND_SDS)
    verdict = np.where(inside, EQUIVALENT, np.where(table.p_holm < FAMILY_LEVEL, DIFFERS, NOT_RESOLVED))
    return table.assign(verdict=pd.Series(verdict, index=table.index, dtype=object).where(table.p.notna()))


def group_of(measure: str) -> str:
    """Name of the group of `MEASURES` or `TAPE_MEASURES` that a judged measure belongs to."""
    return next(name for name, start in (MEASURES | TAPE_MEASURES).items() if measure.startswith(start))


def judged_rows(structure_errors: pd.DataFrame, slurries: Sequence[str]) -> pd.DataFrame:
    """Rows of tables/structure_errors.csv that are judged: `MEASURES` of relaxed structures of these slurries."""
    relaxed = (structure_errors.stage == "relaxed") & structure_errors.slurry.isin(slurries)
    return structure_errors[relaxed & structure_errors.quantity.str.startswith(tuple(MEASURES.values()))]


def judged_tape_rows(microstructure: pd.DataFrame, slurries: Sequence[str]) -> pd.DataFrame:
    """Rows of tables/microstructure.csv or tape_errors.csv that are judged, with `surrogate` for the source.

    They are `TAPE_MEASURES` of surrogates' tapes of these slurries that scatter between replicas.
    """
    of_surrogate = (microstructure.stage == "tape") & (microstructure.source != "dem")
    rows = microstructure[of_surrogate & microstructure.slurry.isin(slurries) & (microstructure.replica_sd > 0)]
    judged = rows.quantity.str.startswith(tuple(TAPE_MEASURES.values()))
    return rows[judged & ~rows.quantity.str.fullmatch(_NOT_OF_TAPES)].rename(columns={"source": "surrogate"})


def by_verdict(verdicts: Mapping[str, str | None]) -> list[tuple[str | None, list[str]]]:
    """Group what `compare` returns into (verdict, what is compared), the worse first: [("worse", ["density"]), ...]."""
    return [
        (verdict, [name for name, found in verdicts.items() if found == verdict])
        for verdict in ("worse", "better", NOT_RESOLVED, None)
        if verdict in verdicts.values()
    ]


def compare(differences: Mapping[Hashable, Sequence[float]]) -> dict[Hashable, str | None]:
    """Which errors are smaller than those of the reference.

    Parameters
    ----------
    differences
        By what is compared: error less that of the reference, slurry by slurry. All that a page compares at one place.

    Returns
    -------
    "better" or "worse" where `holm` of the t tests over all entries is below `FAMILY_LEVEL`, else "not resolved"; None
    where there are fewer than `FEWEST_TO_JUDGE` slurries.
    """
    means = [mean_difference(values) for values in differences.values()]
    verdicts = []
    for mean, p in zip(means, holm([mean.p for mean in means]), strict=True):
        resolved = ("better" if mean.mean < 0 else "worse") if p < FAMILY_LEVEL else NOT_RESOLVED
        verdicts.append(None if np.isnan(p) else resolved)
    return dict(zip(differences, verdicts, strict=True))
