"""Numbers of the report: what its tables, captions and sentences show, for the templates to word and format.

Rows of tables hold numbers, texts, ranges (pandas Series) and values with their slurry; None shows as a dash.
"""

from collections.abc import Mapping

import pandas as pd

from slurrycast.analysis.temperatures import DENSIFIED
from slurrycast.analysis.training_range import DENSITY_PREFIX, RADIUS_PREFIX, THIS_RUN
from slurrycast.evaluation.verdicts import by_verdict, compare
from slurrycast.report import reference_article as article
from slurrycast.report.formats import MISSING, number, widest
from slurrycast.report.names import pair_name, range_quantity
from slurrycast.report.results import Results, with_differences
from slurrycast.surrogates import family

DENSITY_TOLERANCE = 0.02  # a final density this far from the expected one is worth a notice
AFFINE = "affine"  # what a network is held against: it learns nothing but one packing fraction
MOST_ALIKE = 3  # notices of one kind that are shown one by one
ROLE_NAMES = {"train": "training", "validation": "validation", "test": "test", "new": "new"}


# ---- the reference article


def article_structures() -> pd.DataFrame:
    """Final structures of the article by slurry, with the columns of `Results.structures`."""
    dem, hybrid = (
        pd.DataFrame(table.values(), index=list(table)).set_axis(["density", "volume"], axis="columns")
        for table in (article.DEM_STRUCTURE, article.HYBRID_STRUCTURE)
    )
    return with_differences(hybrid.join(dem.add_prefix("dem_")))


def article_errors() -> pd.DataFrame:
    """mse_um2, mae_um and r2 of the article by slurry."""
    return pd.DataFrame(article.COORDINATE_ERRORS.values(), index=list(article.COORDINATE_ERRORS))


# ---- notices and summary


def notices(results: Results) -> dict:
    """What limits the results: runs not in equilibrium, structures not at rest, odd densities, extrapolation."""
    dem = results.density[results.density.model == "DEM"]
    dried = results.drying_ends
    dem = dem.assign(expected_g_cm3=dem.slurry.map(results.expected_g_cm3))
    odd = dem[(dem.density_g_cm3 / dem.expected_g_cm3 - 1).abs() > DENSITY_TOLERANCE]
    return {
        "unsettled": [row for row in results.equilibrium.itertuples() if row.warning],
        "odd_densities": list(odd.itertuples()),
        "restless": list(results.relaxation_ends.dropna(subset=["warning"]).itertuples()),
        "restless_tapes": [] if dried is None else list(dried.dropna(subset=["warning"]).itertuples()),
        "most_alike": MOST_ALIKE,
        "density_tolerance": DENSITY_TOLERANCE,
        "extrapolations": extrapolations(results),
        "range_known": range_known(results),
        "adopted": results.adopted,
    }


def range_known(results: Results) -> list[str]:
    """Whose training range is known: that of this run, and labels of models that were trained elsewhere."""
    return [] if results.training_range is None else list(dict.fromkeys(results.training_range.model))


def extrapolations(results: Results) -> list[dict]:
    """In what slurries lie outside the training range, one entry for all that do so on the same sides.

    Each entry has `slurries`, `model` (whose training range it is; none for this run's), and `quantities`: name and
    format, values, and training range. None where the training range is not known.
    """
    if results.training_range is None:
        return []
    outside = results.training_range[results.training_range.outside == "yes"]
    slurries_by_sides = {}
    for (model, slurry), rows in outside.groupby(["model", "slurry"], sort=False):
        sides = tuple(zip(rows.quantity, rows.value > rows.training_max, strict=True))
        slurries_by_sides.setdefault((model, sides), []).append(slurry)
    entries = []
    for (model, _), slurries in slurries_by_sides.items():
        of_them = outside[outside.slurry.isin(slurries) & (outside.model == model)]
        by_quantity = of_them.groupby("quantity", sort=False)
        quantities = [
            {"name": range_quantity(quantity), "reached": rows.value, "training": training_limits(rows)}
            for quantity, rows in by_quantity
        ]
        whose = None if model == THIS_RUN else model
        entries.append({"slurries": slurries, "model": whose, "quantities": quantities})
    return entries


def training_limits(rows: pd.DataFrame) -> pd.Series:
    """Both ends of the training range in rows of tables/training_range.csv on one quantity."""
    return rows[["training_min", "training_max"]].iloc[0]


def gains_over_affine(results: Results) -> list[dict]:
    """What each network adds to the affine map over the test slurries; none where one of the two has no prediction."""

    def paired(errors: Mapping[str, pd.Series]) -> pd.DataFrame:
        return pd.DataFrame(errors).reindex(results.test)

    gains, differences = [], {}
    for surrogate in results.networks:
        names = (surrogate, AFFINE)
        mse = paired({name: results.errors(name).mse_um2 for name in names})
        ratio = (mse[surrogate] / mse[AFFINE]).dropna()
        if ratio.empty:
            continue
        errors = {"density": paired({name: results.structures(name).share.abs() for name in names})}
        for pair in results.pairs:
            differing = {name: results.rdf_differences(name, pair) for name in names}
            errors[f"the RDF of {pair_name(pair)}"] = paired(differing)
        differences[surrogate, "coordinates"] = ratio - 1
        differences |= {(surrogate, name): table[surrogate] - table[AFFINE] for name, table in errors.items()}
        means = {name: (table[surrogate].mean(), table[AFFINE].mean()) for name, table in errors.items()}
        gains.append({"surrogate": surrogate, "mse_ratio": ratio, "means": means})
    verdicts = compare(differences)
    for gain in gains:
        gain["verdicts"] = {name: verdict for (of, name), verdict in verdicts.items() if of == gain["surrogate"]}
        relaxed = [verdict for name, verdict in gain["verdicts"].items() if name != "coordinates"]
        gain["adds_nothing"] = None not in relaxed and "better" not in relaxed
        gain["in_short"] = by_verdict(gain["verdicts"])
    return gains


def key_results(results: Results) -> dict:
    """Means over the test slurries, one for each surrogate, and the article's."""
    labels, test = results.surrogates, results.test
    shares = [results.structures(name).share.abs().reindex(test) for name in labels]
    article_shares = article_structures().share.abs()

    ratios = results.speedups("wall_s")
    ratios = ratios[ratios.slurry.isin(test)].groupby("surrogate")[["ratio", "ratio_to_equilibrium"]].mean()

    def means(column: str) -> list[float]:
        return [results.mean_over_test(results.errors(name)[column]) for name in labels]

    return {
        "mse_um2": means("mse_um2"),
        "r2": means("r2"),
        "density": pd.Series([share.mean() for share in shares]),
        "largest": [widest(share) for share in shares],
        "rdf": [
            (pair_name(pair), [results.mean_over_test(results.rdf_differences(name, pair)) for name in labels])
            for pair in results.pairs
        ],
        **ratios.reindex(labels).to_dict("series"),
        "article_errors": article_errors().mean(),
        "article_share": article_shares.mean(),
        "article_largest": widest(article_shares),
    }


# ---- settings, DEM runs, networks


def settings(results: Results) -> dict:
    """Settings of this run and the article's, and the formulations with what was reached."""
    dem, learning = results.config["dem"], results.config["learning"]
    steps_per_frame = dem["steps"] // (dem["frames"] - 1)
    full_runs = results.slurries("train", "validation", "test")
    jobs = results.costs[(results.costs.stage == "run_slurry") & results.costs.slurry.isin(full_runs)]
    reached = {slurry: inputs["mass_fractions_reached"] for slurry, inputs in results.inputs.items()}
    phases = []
    for formulation in dict.fromkeys(results.formulations[slurry] for slurry in reached):
        of_it = [slurry for slurry in reached if results.formulations[slurry] == formulation]
        for phase, recipe in results.inputs[of_it[0]]["physics"]["formulation"]["phases"].items():
            classes = ", ".join(f"{c['diameter_um']:g} ({c['number_fraction']:g})" for c in recipe["size_classes"])
            wanted, fractions = recipe["mass_fraction"], pd.Series([reached[slurry][phase] for slurry in of_it])
            deviation = 100 * (fractions - wanted).abs().max()
            row = [phase, recipe["density_g_cm3"], classes, wanted, fractions, deviation]
            phases.append([formulation or "default", *row] if results.config["formulations"] else row)
    return {
        "simulated_us": dem["steps"] * dem["timestep_us"],
        "steps_per_frame": steps_per_frame,
        "input_steps": [frame * steps_per_frame for frame in learning["input_frames"]],
        "target_step": learning["target_frame"] * steps_per_frame,
        "article_simulated_us": article.STEPS * article.TIMESTEP_US,
        "article_input_steps": [frame * article.STEPS_PER_FRAME for frame in article.INPUT_FRAMES],
        "article_full_dem_s": 60 * article.FULL_DEM_MIN,
        "wall_s": jobs.wall_s,
        "samples": sum(results.particles[slurry] for slurry in results.slurries("train")),
        "training": {
            label: training_settings(results, label) for label in results.networks if label not in results.adopted
        },
        "phases": phases,
    }


def training_settings(results: Results, surrogate: str) -> dict:
    """Settings of a network, with the epochs that were run."""
    settings, history = results.config["surrogate"].get(family(surrogate), {}), results.histories[surrogate]
    return settings | ({} if history.empty else {"epochs": len(history)})


def dem_runs(results: Results) -> dict:
    """The slurries at the end of their DEM run and their way to equilibrium."""
    equilibrium = results.equilibrium
    settled_us = equilibrium.time_to_equilibrium_us.where(equilibrium.warning == "")
    table = equilibrium.assign(role=equilibrium.role.map(ROLE_NAMES), time_to_equilibrium_us=settled_us)
    columns = ["slurry", "role", "mass_units", "thickness_ratio", "particles", "run_time_us", "density_g_cm3"]
    columns += ["mean_contacts", "density_drift", "time_to_equilibrium_us", "temperature_densifying_k"]
    columns += ["temperature_k", "temperature_rotational_k", "kinetic_share"]
    complete = equilibrium[equilibrium.role != "new"]
    settled = complete[complete.warning == ""].dropna(subset=["time_to_equilibrium_us"])
    return {
        "rows": table[columns].to_numpy().tolist(),
        "times_us": settled.time_to_equilibrium_us,
        "slowest": None if settled.empty else settled.loc[settled.time_to_equilibrium_us.idxmax()],
        "densified": DENSIFIED,
        "has_new": len(complete) < len(equilibrium),
        "not_settled": list(complete.slurry[complete.warning != ""]),
    }


def surrogates(results: Results) -> dict:
    """What the surrogates are, and the layers and learning curves of each network."""
    networks = []
    for surrogate, network in results.networks.items():
        rows = [
            [layer.name, " × ".join(map(str, layer.output_shape or [MISSING])), layer.parameters]
            for layer in network.layers
        ]
        networks.append(
            {
                "name": surrogate,
                "rows": [*rows, ["Total", "", network.parameters]],
                "parameters": network.parameters,
                "as_in_article": network.parameters == article.PARAMETERS,
                "several_inputs": sum(layer.name.startswith("Input") for layer in network.layers) > 1,
                "history": learning_curves(results, surrogate),
            }
        )
    return {"descriptions": [[name, *results.descriptions[name]] for name in results.surrogates], "networks": networks}


def learning_curves(results: Results, surrogate: str) -> dict | None:
    """First, best and last epoch of a network, and whose weights are used; None where it came without curves."""
    history = results.histories[surrogate]
    if history.empty:
        return None
    best = None if history.val_loss.isna().all() else history.loc[history.val_loss.idxmin()]
    last = history.iloc[-1]
    used = None if surrogate in results.adopted else results.weights_of[surrogate]
    settings = results.config["surrogate"].get(family(surrogate), {})
    return {
        "epochs": len(history),
        "settled": settings if used and len(history) < settings.get("epochs", 0) else None,
        "held_out": "test_slurries_loss" in history,
        "first": history.iloc[0],
        "last": last,
        "best": best,
        "used": used,
        "still_falling": best is not None and used == "lowest" and len(history) > 1 and best.epoch == last.epoch,
    }


def training_range(results: Results) -> dict | None:
    """The predicted slurries beside the range of the training slurries; what is outside is marked. None without any.

    Radii and densities of the phases are there where a slurry is outside in one.
    """
    table = results.training_range
    if table is None and not results.networks:
        return None
    if table is None or not (table.outside == "yes").any():
        return {"known": bool(range_known(results)), "columns": [], "rows": []}
    outside = set(table.quantity[table.outside == "yes"])
    of_phases = table.quantity.str.startswith((RADIUS_PREFIX, DENSITY_PREFIX))
    table = table[~of_phases | table.quantity.isin(outside)]
    names = {name: range_quantity(name) for name in dict.fromkeys(table.quantity)}
    rows = []
    for model, of_model in table.groupby("model", sort=False):
        limits = dict(iter(of_model.groupby("quantity")))
        head = "training" if model == THIS_RUN else f"training of {model}"
        rows.append([head, *(training_limits(limits[name]) if name in limits else "-" for name in names)])
        for slurry, of_slurry in of_model.groupby("slurry", sort=False):
            by_quantity = {row.quantity: row for row in of_slurry.itertuples()}
            cells = [range_cell(by_quantity.get(name), quantity.form) for name, quantity in names.items()]
            rows.append([results.row_name(slurry), *cells])
    return {"known": True, "columns": [(quantity.column, quantity.form) for quantity in names.values()], "rows": rows}


def range_cell(row: tuple | None, form: str) -> str:
    """A value of a slurry, marked where it is outside; "-" for a quantity that only others have."""
    if row is None:
        return "-"
    mark = (" ▲" if row.value > row.training_max else " ▼") if row.outside == "yes" else ""
    return number(row.value, form) + mark
