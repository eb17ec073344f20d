"""Numbers of the report on hybrid against DEM, new slurries, cost and versions, for the templates to format."""

from collections.abc import Mapping, Sequence
from itertools import chain, product

import numpy as np

from slurrycast.evaluation.speedup import HYBRID_PARTS, TAPE_PARTS, time_unit
from slurrycast.report import reference_article as article
from slurrycast.report.formats import number, numbers, widest
from slurrycast.report.names import pair_name
from slurrycast.report.results import Results
from slurrycast.report.statistics import article_errors, article_structures


def slurry_rows(results: Results, columns: Sequence[Mapping]) -> list[list]:
    """A row for each compared slurry: its name, and its value in each of `columns` (by slurry)."""
    return [[results.row_name(slurry), *(values.get(slurry) for values in columns)] for slurry in results.compared]


def coordinates(results: Results) -> dict:
    """Errors of coordinates: rows of MSE and R2 in the own box, and of MAE and MSE in the true box."""
    errors = {name: results.errors(name) for name in results.surrogates}
    tested = {name: table.reindex(results.test).dropna() for name, table in errors.items()}

    def rows(columns: Sequence[str], article_columns: Sequence[str]) -> list[list]:
        values = [table[column] for column in columns for table in errors.values()]
        beside = [article_errors()[column] for column in article_columns]
        lines = slurry_rows(results, [*values, *beside])
        if results.test:
            lines.append(["mean, test", *map(results.mean_over_test, values), *(column.mean() for column in beside)])
        return lines

    gains = [(name, widest(1 - table.mse_um2_true_box / table.mse_um2)) for name, table in tested.items()]
    return {
        "rows": rows(["mse_um2", "r2"], ["mse_um2", "r2"]),
        "true_box_rows": rows(["mae_um", "mse_um2_true_box"], ["mae_um"]),
        "extremes": [
            (name, table.mse_um2.idxmin(), table.mse_um2.idxmax()) for name, table in tested.items() if len(table)
        ],
        "gains": [(name, gain) for name, gain in gains if gain and gain.value > 0],
        "figures": [coordinates_figure(results, slurry) for slurry in results.compared],
    }


def coordinates_figure(results: Results, slurry: str) -> dict:
    """Of one slurry: MSE and worst axis of each surrogate that predicts places, and the article's R2 on each axis."""
    rows = results.coordinate_errors[results.coordinate_errors.slurry == slurry]
    mse_um2 = rows.pivot(index="axis", columns="surrogate", values="mse_um2")
    placed = [name for name in results.surrogates if name in mse_um2]
    errors = [(name, mse_um2[name]["all"], mse_um2[name].drop("all").idxmax()) for name in placed]
    return {"slurry": slurry, "errors": errors, "article_r2": list(article.R2_PER_AXIS.get(slurry, {}).values())}


def densities(results: Results) -> dict:
    """Density and volume of final structures, DEM and hybrid, and how far hybrid densities are from the DEM's."""
    structures = {name: results.structures(name) for name in results.surrogates}
    published, (first, *_) = article_structures(), structures.values()
    shares = [table.share for table in structures.values()]
    columns = [first.dem_density, *(table.density for table in structures.values()), *shares]
    rows = slurry_rows(results, [*columns, published.dem_density, published.density, published.share])
    if results.test:
        means = numbers((results.mean_over_test(share.abs()) for share in shares), ".2%")
        article_mean = number(published.share.abs().mean(), ".1%")
        rows.append(["mean, test, absolute", *[None] * (1 + len(shares)), *means, None, None, article_mean])
    volumes = [first.dem_volume, *(table.volume for table in structures.values())]
    deviations = []
    for surrogate, table in structures.items():
        sizes = table.reindex(results.test).dropna().difference.abs()
        if largest := widest(sizes):
            deviations.append(
                {"surrogate": surrogate, "mean": sizes.mean(), "largest": largest, "share": table.share[largest.slurry]}
            )
    return {
        "rows": rows,
        "volume_rows": slurry_rows(results, [*volumes, published.dem_volume, published.volume]),
        "deviations": deviations,
        "article_mean": published.difference.abs().mean(),
        "article_max": published.difference.abs().max(),
    }


def rdfs(results: Results) -> dict:
    """Differences of RDFs by slurry, pair and surrogate; the range of r depends on the boxes of the surrogates."""
    errors, pairs = results.rdf_errors, results.pairs
    differences = {pair: [results.rdf_differences(name, pair) for name in results.surrogates] for pair in pairs}
    columns = list(chain.from_iterable(differences.values()))
    by_slurry = errors.groupby("slurry")
    rows = slurry_rows(results, [dict(list(by_slurry.r_max_um)), dict(list(by_slurry.bins)), *columns])
    if results.test:
        rows.append(["mean, test", "", "", *map(results.mean_over_test, columns)])
    spans = []
    for pair, series in differences.items():
        tested = [values.reindex(results.test).dropna() for values in series]
        named = zip(results.surrogates, tested, strict=True)
        if known := [(name, values, values.idxmax()) for name, values in named if len(values)]:
            spans.append((pair_name(pair), known))
    return {
        "rows": rows,
        "pairs": [pair_name(pair) for pair in pairs],
        "spans": spans,
        "r_max_um": errors.r_max_um,
        "cut_short": len(errors) > 0 and errors.r_max_um.min() < 0.99 * results.config["analysis"]["rdf_cutoff_um"],
    }


def pictures(results: Results, slurries: Sequence[str]) -> list[dict]:
    """3D pictures of `slurries`, for the surrogates that have them, and how the thickness differs from the target's."""
    entries = []
    for slurry, surrogate in product(slurries, results.surrogates):
        stem = f"slurry_{surrogate}_{slurry}"
        if stem in results.figures:
            structure = results.structures(surrogate).loc[slurry]
            # The boxes keep their proportions, so edges go with the cube root of the volume.
            change = np.cbrt(structure.volume / structure.dem_volume) - 1
            label = f"Fig. 4, slurry {slurry}, {surrogate}"
            entries.append({"stem": stem, "label": label, "density": structure.density, "change": change})
    return entries


def relaxation_ends(results: Results) -> dict:
    """State of the relaxed structures of each surrogate at the end of their relaxation, as ranges over slurries."""
    rows = []
    for surrogate in results.surrogates:
        ends = results.relaxation_ends[results.relaxation_ends.surrogate == surrogate]
        temperatures = [ends.temperature_k, ends.temperature_rotational_k]
        rows.append([surrogate, ends.kinetic_share.max(), *temperatures, ends.pressure_kpa])
    return {"rows": rows}


def new_slurries(results: Results) -> dict | None:
    """Slurries without a target: what the chain says of them; None where there are none."""
    new = results.slurries("new")
    if not new:
        return None
    at_input = results.equilibrium.set_index("slurry").density_g_cm3.reindex(new).dropna()
    rows = []
    for surrogate in results.surrogates:
        for slurry, structure in results.structures(surrogate).reindex(new).dropna(subset="density").iterrows():
            mass_units = results.inputs[slurry]["physics"]["slurry"]["mass_units"]
            against = structure.density / results.expected_g_cm3[slurry] - 1
            before = [mass_units, results.particles[slurry], *at_input[at_input.index == slurry]]
            rows.append([slurry, surrogate, *before, structure.density, against, structure.volume])
    return {"rows": rows, "pictures": pictures(results, new), "simulated": len(at_input) > 0}


# ---- cost and provenance


def costs(results: Results) -> dict:
    """What each slurry and each stage took, and how many times the hybrid run fits into the DEM."""
    wall, cpu = results.speedups("wall_s"), results.speedups("cpu_s")
    scope = results.test or list(dict.fromkeys(wall.slurry))
    shown = wall[wall.slurry.isin(scope)]
    length_s, unit = time_unit(shown[["dem", "hybrid"]].max(axis=None))
    part_names = {part: name for part, name in HYBRID_PARTS.items() if shown[part].any()}
    columns = [*part_names, "hybrid", *(["dem", "dem_to_equilibrium"] if shown.dem.notna().any() else [])]
    parts = [[name, *(shown.loc[shown.surrogate == name, columns].mean() / length_s)] for name in results.surrogates]
    dried = shown.dropna(subset=["hybrid_to_tape"])
    tapes = []
    if not dried.empty:
        columns = ["hybrid", *TAPE_PARTS, "hybrid_to_tape", "dem", "dem_to_tape"]
        tapes = (dried.groupby("surrogate", sort=False)[columns].mean() / length_s).reset_index().values.tolist()

    known = shown.dropna(subset=["ratio"]).groupby("surrogate", sort=False)
    shares = known[list(HYBRID_PARTS)].sum()
    shares = shares.div(shares.sum(axis=1), axis=0)
    ratios = ((wall, "ratio"), (wall, "ratio_to_equilibrium"), (cpu, "ratio"))
    ratio_columns = [
        table[table.surrogate == name].set_index("slurry")[column]
        for table, column in ratios
        for name in results.surrogates
    ]
    stages = results.costs[results.costs.stage != "run_slurry_to_input"].groupby("stage", sort=False)
    sums = {"jobs": ("wall_s", "size"), "wall_s": ("wall_s", "sum"), "cpu_s": ("cpu_s", "sum")}
    by_stage = stages.agg(**sums, longest_s=("wall_s", "max"), max_rss_mb=("max_rss_mb", "max"))
    return {
        "scope": scope,
        "unit": unit,
        "part_names": list(part_names.values()),
        "parts": parts,
        "tapes": tapes,
        "dried": list(dict.fromkeys(dried.slurry)),
        "ratios": list(known.ratio),
        "early_ratios": [(name, early.dropna()) for name, early in known.ratio_to_equilibrium if early.notna().any()],
        "largest_parts": [(name, HYBRID_PARTS[row.idxmax()], row.max()) for name, row in shares.iterrows()],
        "ratio_rows": slurry_rows(results, ratio_columns),
        "stage_rows": [[stage.replace("_", " "), *values] for stage, *values in by_stage.itertuples()],
        "adopted": results.adopted,
        "trainings": list(results.costs[results.costs.stage == "train_surrogate"].itertuples()),
    }


def provenance(results: Results) -> dict:
    """Versions of all programs, and those of LAMMPS as its logs say."""
    versions = {}
    for key, value in results.versions.items():
        versions |= value if isinstance(value, Mapping) else {key: value}
    return {
        "versions": [[str(key).replace("_", " "), str(value)] for key, value in versions.items()],
        "lammps": sorted({str(run["lammps_version"]) for run in results.runs.values()}),
    }
