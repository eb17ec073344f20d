"""Numbers of the evaluation's page: what its tables, captions and sentences show, for the templates to word and format.

Rows of tables hold numbers, texts and values with their slurry; None and NaN show as a dash.
"""

import numpy as np
import pandas as pd

from slurrycast.evaluation.front import mean_front, on_front
from slurrycast.evaluation.noise import BAND_SDS
from slurrycast.evaluation.relaxation import BANDS, enough_steps, mean_errors
from slurrycast.report.evaluation_results import Evaluation, labels_of, main_labels_of
from slurrycast.report.formats import listed, number, numbers
from slurrycast.report.names import column_name, quantity_name
from slurrycast.report.verdict_statistics import ERRORS_AT_EQUAL_COST, mean_and_worst

WIDEST_LEVEL, COVERED_WELL = 0.9, (0.85, 0.95)  # a calibrated level, and the coverages that keep to it


def plain_table(table: pd.DataFrame) -> dict:
    """All rows and columns of `table` as they are, for a table of three digits."""
    forms = ["plain" if pd.api.types.is_numeric_dtype(table[column]) else "text" for column in table]
    rows = [numbers(row, "plain") for row in table.astype(object).itertuples(index=False)]
    return {"columns": list(zip(map(column_name, table), forms, strict=True)), "rows": rows}


def skill(evaluation: Evaluation) -> dict:
    """tables/skill.csv."""
    rows = []
    for surrogate, group in evaluation.skill.groupby("surrogate", sort=False):
        by_slurry = group.set_index("slurry")
        tested = by_slurry.reindex(evaluation.test)
        validated = by_slurry.skill.reindex(evaluation.slurries("validation"))
        ratio = (tested.mse_um2 / tested.mse_affine_um2).mean()
        rows.append([surrogate, tested.mse_um2.mean(), ratio, *mean_and_worst(tested.skill, True), validated.mean()])
    means = evaluation.tested(evaluation.skill).groupby("surrogate", sort=False).skill.mean().dropna()
    return {"rows": rows, "best": (means.idxmax(), means.max()) if len(means) else None}


def noise(evaluation: Evaluation) -> dict:
    """tables/noise.csv: mean and sd of each replicated slurry, and how far a perturbed run ends from its DEM run."""
    table = evaluation.noise
    slurries = list(dict.fromkeys(table.slurry))
    by_key = table.set_index(["slurry", "quantity"])[["mean", "sd"]]
    rows = []
    for quantity in dict.fromkeys(table.quantity):
        known = by_key.reindex([(slurry, quantity) for slurry in slurries]).to_numpy(dtype=float)
        texts = [text for mean, sd in known for text in (number(mean, ".4g"), number(sd, ".2g"))]
        rows.append([quantity_name(quantity), *texts])
    density = table[table.quantity == "density_g_cm3"].set_index("slurry").rename(columns={"mean": "mean_g_cm3"})
    density = density.assign(band_g_cm3=BAND_SDS * density.sd, band_share=BAND_SDS * density.sd / density.mean_g_cm3)
    floors_um2 = table[table.quantity == "perturbation_floor_um2"].set_index("slurry")["mean"]
    return {"rows": rows, "slurries": slurries, "densities": density.to_dict("index"), "floors_um2": dict(floors_um2)}


def structure(evaluation: Evaluation) -> dict:
    """tables/structure_errors.csv: mean deviations by stage."""
    table = evaluation.tested(evaluation.structure_errors)
    table = table.assign(deviation=(table.value - table.dem_value).abs())
    labels = main_labels_of(table)
    tables = []
    for stage in ("predicted", "relaxed"):
        means = table[table.stage == stage].pivot_table("deviation", "quantity", "surrogate", sort=False)
        rows = [[quantity_name(name), *values] for name, *values in means.reindex(columns=labels).itertuples()]
        tables.append({"stage": stage, "rows": rows})
    return {"labels": labels, "tables": tables}


def front(evaluation: Evaluation) -> dict:
    """tables/front.csv, and which surrogates are on the front of each error against cost."""
    tested = evaluation.tested(evaluation.front)
    rows = []
    for (surrogate, frame), group in tested.groupby(["surrogate", "input_last_frame"], sort=False):
        by_slurry = group.set_index("slurry")
        errors = [*mean_and_worst(by_slurry.density_error), *mean_and_worst(by_slurry.rdf_error)]
        rows.append([surrogate, frame, by_slurry.cost_share_of_full_dem.mean(), *errors])
    fronts = []
    if not tested.empty:
        means = mean_front(tested)
        for column, name in (("density_error", "density"), ("rdf_error", "RDF")):
            fronts.append((name, list(means.surrogate[on_front(means.cost_share_of_full_dem, means[column])])))
    return {"rows": rows, "fronts": fronts}


def equal_cost(evaluation: Evaluation) -> dict:
    """tables/equal_cost.csv: means over the test slurries where both are known."""
    rows = []
    for surrogate, group in evaluation.tested(evaluation.equal_cost).groupby("surrogate", sort=False):
        known = group.dropna(subset=["early_dem_cost_share"])
        cells = []
        for column in ("cost_share", *ERRORS_AT_EQUAL_COST):
            beside = "cost_share_of_full_dem" if column == "cost_share" else column
            both = known[[beside, f"early_dem_{column}"]].dropna()
            cells += [both[name].mean() for name in both]
        notes = group.note.dropna().value_counts()
        beyond = "; ".join(f"{note} ({count})" for note, count in notes.items())
        rows.append([surrogate, *cells, f"{group.note.isna().sum()} of {len(group)}", beyond])
    return {"rows": rows}


def cost(evaluation: Evaluation) -> dict:
    """tables/cost_scaling.csv and tables/article_costs.csv, and when the training of each network is paid back."""
    scaling, claims = evaluation.cost_scaling, evaluation.article_costs
    by_wall_clock = scaling[scaling.clock == "wall_s"].set_index("surrogate")
    labels = main_labels_of(claims)
    terms = [column for column in ("term", "unit", "article", "article_says") if column in claims]
    texts = ["unit", "article_says"]  # both can be empty for all terms, and then are no text
    shown = claims[claims.surrogate.isin(labels)].astype(dict.fromkeys(texts, object)).fillna(dict.fromkeys(texts, ""))
    wide = shown.set_index([*terms, "surrogate"]).ours.unstack(sort=False).reset_index()
    return {
        "paybacks": [
            payback(name, by_wall_clock.loc[name]) for name in evaluation.networks if name in by_wall_clock.index
        ],
        "scaling": plain_table(scaling[scaling.surrogate.isin(main_labels_of(scaling))]),
        "claims": plain_table(wide),
    }


def payback(network: str, row: pd.Series) -> dict:
    """One row of tables/cost_scaling.csv with `outcome`, when the training is paid back, and `grows`.

    `outcome` is "paid", "never", "no training time" or "no test slurry"; `grows` says whether exponents are known.
    """
    if pd.isna(row.training_s):
        outcome = "no training time"
    elif pd.isna(row.saved_s_per_slurry):
        outcome = "no test slurry"
    else:
        outcome = "paid" if row.saved_s_per_slurry > 0 else "never"
    grows = pd.notna(row.hybrid_exponent)
    return {"network": network, "row": row, "outcome": outcome, "lost_s": -row.saved_s_per_slurry, "grows": grows}


def ablation(evaluation: Evaluation) -> dict | None:
    """tables/ablation.csv and the lowest MSE on the validation slurries; None where the run has none."""
    if evaluation.ablation is None:
        return None
    scored = evaluation.ablation.set_index("surrogate").validation_mse_um2.dropna()
    return plain_table(evaluation.ablation) | {"best": (scored.idxmin(), scored.min()) if len(scored) else None}


def relaxation(evaluation: Evaluation) -> dict | None:
    """tables/relaxation.csv, and which steps are enough; None without validation slurries."""
    table = evaluation.relaxation
    if table is None:
        return None
    labels, tried = labels_of(table), sorted(set(table.steps))
    enough = enough_steps(table)
    overlap = table.groupby("surrogate").overlap_mean_predicted.mean()
    means = {column: mean_errors(table, column, labels) for column in (*BANDS, "cpu_s")}
    rows, labels_by_steps = [], {}
    for name in labels:
        cells = [means[column].loc[name, steps] for column in means for steps in tried]
        rows.append([name, overlap[name], *cells, listed(numbers(enough[name], ",")) or "none"])
        labels_by_steps.setdefault(tuple(enough[name]), []).append(name)
    return {
        "tried": numbers(tried, ","),
        "slurries": list(dict.fromkeys(table.slurry)),
        "enough": [
            (numbers(steps, ","), names)
            for steps, names in sorted(labels_by_steps.items(), key=lambda part: (not part[0], part[0]))
        ],
        "rows": rows,
    }


def uncertainty(evaluation: Evaluation) -> dict | None:
    """tables/uncertainty.csv, and whether intervals cover what they should; None where no surrogate has a spread."""
    table = evaluation.uncertainty
    if table is None:
        return None
    levels = sorted(set(table.level))
    rows, intervals = [], []
    for (surrogate, slurry), group in table.groupby(["surrogate", "slurry"], sort=False):
        by_level, first = group.set_index("level").reindex(levels), group.iloc[0]
        cells = by_level[["factor", "coverage"]].to_numpy().ravel()
        rows.append(
            [surrogate, slurry, first.role, *cells, first.rank_correlation, first.mean_spread_um, first.rms_error_um]
        )
    for surrogate, group in evaluation.uncertainty.groupby("surrogate", sort=False):
        tested = evaluation.tested(group[np.isclose(group.level, WIDEST_LEVEL)])
        intervals.append(
            {
                "surrogate": surrogate,
                "coverage": tested.coverage,
                "covered_well": tested.coverage.between(*COVERED_WELL).sum(),
                "rank_correlation": tested.rank_correlation.dropna(),
            }
        )
    return {
        "levels": levels,
        "rows": rows,
        "intervals": intervals,
        "level": WIDEST_LEVEL,
        "covered_well": COVERED_WELL,
    }
