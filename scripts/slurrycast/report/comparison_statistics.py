"""Numbers of the report on hybrid against DEM, new slurries, cost and versions, for the templates to format."""

from collections.abc import Mapping, Sequence

import numpy as np

from slurrycast.evaluation.speedup import HYBRID_PARTS, time_unit
from slurrycast.report import reference_article as article
from slurrycast.report.formats import number
from slurrycast.report.names import pair_name
from slurrycast.report.results import Results
from slurrycast.report.statistics import article_differences, article_mean_errors, article_shares, widest

AXES = ("x", "y", "z")


def coordinates(results: Results) -> dict:
    """Errors of coordinates: rows of MSE and R2 in the own box, and of MAE and MSE in the true box."""
    errors = {name: results.errors(name) for name in results.surrogates}

    def rows(columns: Sequence[str], article_columns: Sequence[str]) -> list[list]:
        lines = []
        for slurry in results.compared:
            known = article.COORDINATE_ERRORS.get(slurry)
            cells = [table[name].get(slurry) for name in columns for table in errors.values()]
            beside = [known and getattr(known, name) for name in article_columns]
            lines.append([results.row_name(slurry), *cells, *beside])
        if results.test:
            means = [results.mean_over_test(table[name]) for name in columns for table in errors.values()]
            lines.append(["mean, test", *means, *article_mean_errors()[list(article_columns)]])
        return lines

    extremes, gains = [], []
    for surrogate, table in errors.items():
        tested = table.reindex(results.test).dropna()
        if tested.empty:
            continue
        extremes.append((surrogate, tested.mse_um2.idxmin(), tested.mse_um2.idxmax()))
        gain = widest(1 - tested.mse_um2_true_box / tested.mse_um2)
        if gain.value > 0:
            gains.append((surrogate, gain))
    return {
        "rows": rows(["mse_um2", "r2"], ["mse_um2", "r2"]),
        "true_box_rows": rows(["mae_um", "mse_um2_true_box"], ["mae_um"]),
        "extremes": extremes,
        "gains": gains,
        "figures": [coordinates_figure(results, slurry) for slurry in results.compared],
    }


def coordinates_figure(results: Results, slurry: str) -> dict:
    """Of one slurry: MSE and worst axis of each surrogate, and the article's R2 on each axis where it states it."""
    errors = []
    for surrogate in results.surrogates:
        by_axis = {axis: results.errors(surrogate, axis).loc[slurry].mse_um2 for axis in AXES}
        errors.append((surrogate, results.errors(surrogate).loc[slurry].mse_um2, max(by_axis, key=by_axis.get)))
    return {"slurry": slurry, "errors": errors, "article_r2": list(article.R2_PER_AXIS.get(slurry, {}).values())}


def densities(results: Results) -> dict:
    """Density and volume of final structures, DEM and hybrid, and how far hybrid densities are from the DEM's."""
    structures = [results.structures(name) for name in results.surrogates]
    rows, volume_rows = [], []
    for slurry in results.compared:
        hybrids = [table.loc[slurry] for table in structures]
        name = results.row_name(slurry)
        row = [
            name,
            hybrids[0].dem_density,
            *(structure.density for structure in hybrids),
            *(structure.share for structure in hybrids),
        ]
        volumes = [name, hybrids[0].dem_volume, *(structure.volume for structure in hybrids)]
        dem, hybrid = article.DEM_STRUCTURE.get(slurry), article.HYBRID_STRUCTURE.get(slurry)
        if dem is None or hybrid is None:
            rows.append([*row, None, None, None])
            volume_rows.append([*volumes, None, None])
        else:
            share = hybrid.density_g_cm3 / dem.density_g_cm3 - 1
            rows.append([*row, dem.density_g_cm3, hybrid.density_g_cm3, share])
            volume_rows.append([*volumes, dem.volume_um3, hybrid.volume_um3])
    if results.test:
        shares = [number(results.mean_over_test(table.share.abs()), ".2%") for table in structures]
        beside = [None, None, number(article_shares().abs().mean(), ".1%")]
        rows.append(["mean, test, absolute", *[None] * (1 + len(structures)), *shares, *beside])
    deviations = []
    for surrogate, table in zip(results.surrogates, structures, strict=True):
        known = table.reindex(results.test).dropna()
        if not known.empty:
            sizes = known.difference.abs()
            largest = widest(sizes)
            deviations.append(
                {"surrogate": surrogate, "mean": sizes.mean(), "largest": largest, "share": known.share[largest.slurry]}
            )
    article_sizes = article_differences().abs()
    return {
        "rows": rows,
        "volume_rows": volume_rows,
        "deviations": deviations,
        "article_mean": article_sizes.mean(),
        "article_max": article_sizes.max(),
    }


def rdfs(results: Results) -> dict:
    """Differences of RDFs by slurry, pair and surrogate; the range of r depends on the boxes of the surrogates."""
    errors, pairs = results.rdf_errors, results.pairs
    differences = [results.rdf_differences(name, pair) for pair in pairs for name in results.surrogates]
    rows = []
    for slurry in results.compared:
        ranges = errors[errors.slurry == slurry]
        cells = [by_slurry.get(slurry) for by_slurry in differences]
        rows.append([results.row_name(slurry), ranges.r_max_um, ranges.bins.astype(float), *cells])
    if results.test:
        rows.append(["mean, test", "", "", *map(results.mean_over_test, differences)])
    spans = []
    for pair in pairs:
        known = {
            name: results.rdf_differences(name, pair).reindex(results.test).dropna() for name in results.surrogates
        }
        known = [(name, values, values.idxmax()) for name, values in known.items() if not values.empty]
        if known:
            spans.append((pair_name(pair), known))
    cutoff_um = results.config["analysis"]["rdf_cutoff_um"]
    return {
        "rows": rows,
        "pairs": [pair_name(pair) for pair in pairs],
        "spans": spans,
        "cutoff_um": cutoff_um,
        "r_max_um": errors.r_max_um,
        "cut_short": not errors.empty and errors.r_max_um.min() < 0.99 * cutoff_um,
    }


def pictures(results: Results, slurries: Sequence[str]) -> list[dict]:
    """3D pictures of `slurries`, for the surrogates that have them, and how the thickness differs from the target's."""
    entries = []
    for slurry in slurries:
        for surrogate in results.surrogates:
            stem = f"slurry_{surrogate}_{slurry}"
            if stem in results.figures:
                structure = results.structures(surrogate).loc[slurry]
                # The boxes keep their proportions, so edges go with the cube root of the volume.
                change = (
                    None if np.isnan(structure.dem_volume) else np.cbrt(structure.volume / structure.dem_volume) - 1
                )
                label = f"Fig. 4, slurry {slurry}, {surrogate}"
                entries.append({"stem": stem, "label": label, "density": structure.density, "change": change})
    return entries


def new_slurries(results: Results) -> dict | None:
    """Slurries without a target: what the chain says of them; None where there are none."""
    new = results.slurries("new")
    if not new:
        return None
    equilibrium, rows = results.equilibrium.set_index("slurry"), []
    for surrogate in results.surrogates:
        structures = results.structures(surrogate)
        for slurry in [slurry for slurry in new if slurry in structures.index]:
            structure, run = structures.loc[slurry], equilibrium.loc[slurry]
            against = structure.density / results.expected_density_g_cm3 - 1
            inputs = [slurry, surrogate, run.mass_units, run.particles, run.density_g_cm3]
            rows.append([*inputs, structure.density, against, structure.volume])
    return {"rows": rows, "pictures": pictures(results, new)}


# ---- cost and provenance


def costs(results: Results) -> dict:
    """What each slurry and each stage took, and how many times the hybrid run fits into the DEM."""
    wall, cpu = results.speedups("wall_s"), results.speedups("cpu_s")
    scope = results.test or list(dict.fromkeys(wall.slurry))
    shown = wall[wall.slurry.isin(scope)]
    length_s, unit = time_unit(shown[["dem", "hybrid"]].max(axis=None))
    columns = [*HYBRID_PARTS, "hybrid", "dem", "dem_to_equilibrium"]
    parts = [[name, *(shown.loc[shown.surrogate == name, columns].mean() / length_s)] for name in results.surrogates]

    ratios, early_ratios, largest_parts = [], [], []
    for surrogate, group in shown.dropna(subset=["ratio"]).groupby("surrogate", sort=False):
        ratios.append((surrogate, group.ratio))
        if group.ratio_to_equilibrium.notna().any():
            early_ratios.append((surrogate, group.ratio_to_equilibrium.dropna()))
        sums = group[list(HYBRID_PARTS)].sum()
        largest_parts.append((surrogate, HYBRID_PARTS[sums.idxmax()], sums.max() / sums.sum()))
    by_pair = [table.set_index(["surrogate", "slurry"]) for table in (wall, wall, cpu)]
    by_pair = [table[name] for table, name in zip(by_pair, ["ratio", "ratio_to_equilibrium", "ratio"], strict=True)]
    ratio_rows = [
        [results.row_name(slurry), *(ratio.get((name, slurry)) for ratio in by_pair for name in results.surrogates)]
        for slurry in results.compared
    ]
    stages = results.costs[results.costs.stage != "run_slurry_to_input"].groupby("stage", sort=False)
    stage_rows = [
        [
            *(stage.replace("_", " "), str(len(jobs)), jobs.wall_s.sum(), jobs.cpu_s.sum()),
            *(jobs.wall_s.max(), jobs.max_rss_mb.max()),
        ]
        for stage, jobs in stages
    ]
    return {
        "scope": scope,
        "unit": unit,
        "part_names": list(HYBRID_PARTS.values()),
        "parts": parts,
        "ratios": ratios,
        "early_ratios": early_ratios,
        "largest_parts": largest_parts,
        "ratio_rows": ratio_rows,
        "stage_rows": stage_rows,
        "trainings": list(results.costs[results.costs.stage == "train_surrogate"].itertuples()),
        "article_ratio": article.FULL_DEM_MIN / article.HYBRID_MIN,
    }


def provenance(results: Results) -> dict:
    """Versions of all programs, and those of LAMMPS as its logs say."""
    flat = {}
    for key, value in results.versions.items():
        flat.update(value if isinstance(value, Mapping) else {key: value})
    return {
        "versions": [[str(key).replace("_", " "), str(value)] for key, value in flat.items()],
        "lammps": sorted({str(run["lammps_version"]) for run in results.runs.values()}),
    }
