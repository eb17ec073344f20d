"""Structural error against cost: what each surrogate reaches, which are on the front, and the DEM at equal cost."""

from collections.abc import Collection, Mapping

import numpy as np
import pandas as pd

from slurrycast.evaluation.noise import BAND_SDS
from slurrycast.surrogates import family

REFERENCE = "early_dem"  # the DEM continued with a faster barostat: what a user would do without any surrogate
ERRORS = ("mse_um2", "density_error", "rdf_error")
KEYS = ("surrogate", "input_last_frame", "slurry")


def structure_error_columns(structure_errors: pd.DataFrame) -> pd.DataFrame:
    """Density and RDF error of every relaxed structure: surrogate, slurry, density_error, rdf_error.

    `structure_errors` is tables/structure_errors.csv. density_error is |density / density of the DEM - 1|, rdf_error
    the mean of |g - g_dem| over all pairs of particles.
    """
    relaxed = structure_errors[structure_errors.stage == "relaxed"]
    keys = ["surrogate", "slurry"]
    density = relaxed[relaxed.quantity == "density_g_cm3"]
    density = density.assign(density_error=(density.value / density.dem_value - 1).abs())[[*keys, "density_error"]]
    rdf = relaxed[relaxed.quantity == "rdf_all"].rename(columns={"value": "rdf_error"})[[*keys, "rdf_error"]]
    return density.merge(rdf, on=keys, validate="one_to_one")


def front(speedup: pd.DataFrame, structure_errors: pd.DataFrame, last_frames: Mapping[str, int]) -> pd.DataFrame:
    """Cost and structural errors of every surrogate and slurry.

    Parameters
    ----------
    speedup
        Rows of `speedup.compare_costs` on one clock.
    structure_errors
        tables/structure_errors.csv.
    last_frames
        Number of each surrogate's last input frame.

    Returns
    -------
    Rows of tables/front.csv: surrogate, input_last_frame, slurry, cost_share_of_full_dem, density_error, rdf_error, for
    the slurries with a full DEM and a structure to compare.
    """
    shares = speedup.assign(
        input_last_frame=speedup.surrogate.map(last_frames), cost_share_of_full_dem=speedup.hybrid / speedup.dem
    )
    keys = ["surrogate", "input_last_frame", "slurry", "cost_share_of_full_dem"]
    shares = shares.dropna(subset=["dem"])[keys].astype({"input_last_frame": int})
    return shares.merge(structure_error_columns(structure_errors), on=["surrogate", "slurry"], validate="one_to_one")


def with_relative_mse(front_table: pd.DataFrame, skill: pd.DataFrame) -> pd.DataFrame:
    """MSE of the predicted coordinates over that of the affine map, beside cost and structural errors.

    Parameters
    ----------
    front_table, skill
        tables/front.csv and tables/skill.csv.

    Returns
    -------
    Rows of `front_table` with `mse_of_affine`, NaN for those without an MSE, such as `direct`.
    """
    relative = skill.assign(mse_of_affine=skill.mse_um2 / skill.mse_affine_um2)
    relative = relative[["surrogate", "slurry", "mse_of_affine"]]
    return front_table.merge(relative, on=["surrogate", "slurry"], how="left", validate="one_to_one")


def mean_front(table: pd.DataFrame) -> pd.DataFrame:
    """Mean of cost and all errors over the slurries of tables/front.csv, one row for each surrogate in order of cost.

    Every row is the mean over the same slurries: those that every surrogate has. An error that one of
    them lacks is NaN.
    """
    common = set.intersection(*(set(rows.slurry) for _, rows in table.groupby("surrogate")))
    means = table[table.slurry.isin(common)].groupby(["surrogate", "input_last_frame"], sort=False)
    means = means[[column for column in table if column not in KEYS]].mean(skipna=False).reset_index()
    return means.sort_values("cost_share_of_full_dem", ignore_index=True)


def non_dominated(cost: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Mark the points that no other point dominates.

    A point dominates another one if neither its cost nor its error is larger, and one of the two is smaller.

    Parameters
    ----------
    cost, error
        Cost and error (n,) of each point.

    Returns
    -------
    Mask (n,).
    """
    cost, error = np.asarray(cost), np.asarray(error)
    no_worse = (cost[:, None] >= cost) & (error[:, None] >= error)
    better = (cost[:, None] > cost) | (error[:, None] > error)
    return ~(no_worse & better).any(axis=1)


def on_front(cost_share: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Mark (n,) the surrogates that neither another one nor the full DEM, with a cost of 1 and no error, dominates."""
    return non_dominated(np.append(cost_share, 1.0), np.append(error, 0.0))[:-1]


def equilibrium_share(speedup: pd.DataFrame, slurries: Collection[str], clock: str) -> float:
    """Cost of the DEM up to its own equilibrium, as a share of the full DEM.

    Parameters
    ----------
    speedup
        tables/speedup.csv.
    slurries, clock
        The slurries that the mean is over, and the clock. Slurries that do not reach equilibrium do not count.

    Returns
    -------
    Mean share; NaN if no slurry counts.
    """
    rows = speedup[(speedup.clock == clock) & speedup.slurry.isin(slurries)].drop_duplicates("slurry")
    return float((rows.dem_to_equilibrium / rows.dem).mean())


def replica_band(structure_errors: pd.DataFrame, slurries: Collection[str]) -> dict[str, float]:
    """Difference of two DEM runs with other seeds.

    Parameters
    ----------
    structure_errors
        tables/structure_errors.csv.
    slurries
        The slurries that the mean is over.

    Returns
    -------
    density_error (BAND_SDS standard deviations) and rdf_error (mean difference); NaN if the table has no replica_sd.
    """
    rows = structure_errors[(structure_errors.stage == "relaxed") & structure_errors.slurry.isin(slurries)]
    density, rdf = (rows[rows.quantity == quantity] for quantity in ("density_g_cm3", "rdf_all"))
    return {
        "density_error": float((BAND_SDS * density.replica_sd / density.dem_value).mean()),
        "rdf_error": float(rdf.replica_sd.mean()),
    }


def is_reference(label: str) -> bool:
    """Whether `label` is one of the DEM continued with a faster barostat."""
    return family(label) == REFERENCE


def reference_at_cost(cost: float, reference: pd.DataFrame) -> tuple[dict[str, float], str]:
    """Errors of the DEM with a faster barostat at equal cost, and a note.

    Parameters
    ----------
    cost
        Cost as a share of the full DEM.
    reference
        Points of the DEM with a faster barostat for one slurry, of all dampings and input frames:
        cost_share_of_full_dem and ERRORS.

    Returns
    -------
    cost_share, the cost at which the errors are taken, and ERRORS; all NaN without any point. The note says on which
    side `cost` is outside the range of the points, if it is.

    Notes
    -----
    The curve through the points is their lower envelope: at the cost of each point, it has the errors of the point with
    the lowest MSE that costs no more; in between it is linear in log cost. Outside the range, the errors are those at
    the nearer end.
    """
    reference = reference.dropna(subset="mse_um2").sort_values("cost_share_of_full_dem", ignore_index=True)
    if reference.empty:
        return dict.fromkeys(("cost_share", *ERRORS), np.nan), f"no {REFERENCE} of this slurry"
    costs = reference.cost_share_of_full_dem.to_numpy()
    lowest = [reference.mse_um2[: place + 1].idxmin() for place in reference.index]
    nearest = float(np.clip(cost, costs[0], costs[-1]))
    errors = {name: float(np.interp(np.log(nearest), np.log(costs), reference[name][lowest])) for name in ERRORS}
    note = ""
    if cost != nearest:
        note = f"{'cheaper' if cost < nearest else 'dearer'} than any {REFERENCE}"
    return {"cost_share": nearest} | errors, note


def at_equal_cost(front_table: pd.DataFrame, skill: pd.DataFrame) -> pd.DataFrame:
    """Every other surrogate beside the DEM with a faster barostat of the same slurry at equal cost, end to end.

    Parameters
    ----------
    front_table, skill
        tables/front.csv and tables/skill.csv.

    Returns
    -------
    Table with the columns surrogate, slurry, cost_share_of_full_dem, early_dem_cost_share, each of ERRORS and
    early_dem_<error>, and note; see `reference_at_cost`.
    """
    points = front_table.merge(skill[["surrogate", "slurry", "mse_um2"]], on=["surrogate", "slurry"], how="left")
    faster = points.surrogate.map(is_reference).astype(bool)
    rows = []
    for point in points[~faster].itertuples():
        beside, note = reference_at_cost(point.cost_share_of_full_dem, points[faster & (points.slurry == point.slurry)])
        row = [point.surrogate, point.slurry, point.cost_share_of_full_dem, beside["cost_share"]]
        for name in ERRORS:
            row += [getattr(point, name), beside[name]]
        rows.append([*row, note])
    columns = ["surrogate", "slurry", "cost_share_of_full_dem", f"{REFERENCE}_cost_share"]
    columns += [column for name in ERRORS for column in (name, f"{REFERENCE}_{name}")]
    return pd.DataFrame(rows, columns=[*columns, "note"])
