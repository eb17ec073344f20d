"""Numbers of explore.html: which inputs matter, how far the fits hold, and the recipes nearest to a target."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from slurrycast.report.names import input_name, tape_quantity

# Goals that the results are held against.
MOST_LOO_PER_REPLICA_SD = 2.0
COVERAGE = (0.80, 0.97)
FEWEST_INDEX = 0.1  # first-order index from which an input is named


@dataclass(frozen=True)
class Exploration:
    """Tables as in results/<run>/tables, without `explore_` in their names; figures by stem."""

    run: str
    table: pd.DataFrame
    noise: pd.DataFrame
    models: pd.DataFrame
    indices: pd.DataFrame
    nearest: pd.DataFrame
    confirmation: pd.DataFrame | None  # where recipes have a full DEM
    costs: pd.DataFrame
    figures: Mapping[str, Path]

    @property
    def names(self) -> dict[str, str]:
        """Name with unit of each property."""
        return {row.property: tape_quantity(row.property, str(row.unit)) for row in self.noise.itertuples()}

    @property
    def inputs(self) -> list[str]:
        """Columns of the inputs that differ between recipes."""
        others = {"slurry", *self.names, *(f"{name}_sd" for name in self.names)}
        return [column for column in self.table if column not in others and self.table[column].nunique() > 1]

    @property
    def different(self) -> int:
        """Number of different recipes."""
        return len(self.table[self.inputs].drop_duplicates())

    @property
    def resolved(self) -> list[str]:
        """Properties that the inputs tell something about."""
        return list(self.models.property[self.models.resolved == "yes"])


def summary(exploration: Exploration) -> Mapping:
    """The inputs in the order in which they matter, and what each property depends on first."""
    indices = exploration.indices[exploration.indices.property.isin(exploration.resolved)]
    means = indices.groupby("input", sort=False).total.mean().sort_values(ascending=False, kind="stable")
    causes = []
    for name, rows in indices.groupby("property", sort=False):
        rows = rows.sort_values("first_order", ascending=False, kind="stable")
        rows = rows[rows.first_order >= FEWEST_INDEX]
        causes.append(
            (exploration.names[name], [(input_name(row.input), row.first_order) for row in rows.itertuples()])
        )
    models = exploration.models
    low, high = COVERAGE
    return {
        "ranking": [(input_name(name), mean) for name, mean in means.items()],
        "causes": causes,
        "unresolved": [exploration.names[name] for name in models.property[models.resolved == "no"]],
        "not_fitted": [name for key, name in exploration.names.items() if key not in set(models.property)],
        "beyond_noise": _named(exploration, models.loo_over_replica_sd > MOST_LOO_PER_REPLICA_SD),
        "covered_wrongly": _named(exploration, ~models.coverage_90_calibrated.between(low, high)),
    }


def _named(exploration: Exploration, rows: pd.Series) -> list[str]:
    return [exploration.names[name] for name in exploration.models.property[rows]]


def inputs(exploration: Exploration) -> Mapping:
    """Rows of the table of indices, one a property."""
    columns = list(dict.fromkeys(exploration.indices.input))
    wide = exploration.indices.pivot(index="property", columns="input", values=["first_order", "total"])
    rows = [
        [exploration.names[name], *(wide.loc[name, (kind, i)] for kind in ("first_order", "total") for i in columns)]
        for name in exploration.resolved
    ]
    return {"inputs": [input_name(column) for column in columns], "rows": rows}


def trust(exploration: Exploration) -> Mapping:
    """Rows of the table of errors and of that of the confirmations, one a property; how many of these are within."""
    means = exploration.noise.set_index("property")["mean"]
    rows = [
        [
            exploration.names[row.property],
            means[row.property],
            row.loo_rmse,
            row.replica_sd,
            row.loo_over_replica_sd,
            row.loo_over_sd,
            row.coverage_90,
            row.coverage_90_calibrated,
        ]
        for row in exploration.models.itertuples()
    ]
    confirmation = exploration.confirmation
    if confirmation is None:
        return {"rows": rows, "confirmed": []}
    compared = [
        [exploration.names[name], of_it.band.iloc[0], *of_it[["direct", "dem", "within_band"]].to_numpy().ravel()]
        for name, of_it in confirmation.groupby("property", sort=False)
    ]
    return {
        "rows": rows,
        "compared": compared,
        "confirmed": list(dict.fromkeys(confirmation.slurry)),
        "within": int((confirmation.within_band == "yes").sum()),
        "judged": int(confirmation.within_band.notna().sum()),
    }


def target(exploration: Exploration) -> Mapping | None:
    """Rows of the recipes nearest to the target; None without one. Targets are (name, wanted value)."""
    nearest = exploration.nearest
    if nearest.empty:
        return None
    wanted = nearest[nearest["rank"] == 1].dropna(subset="target")
    # what is wanted first
    names = dict.fromkeys([*wanted.property, *exploration.models.property])
    rows = []
    for _, of_recipe in nearest.groupby("rank"):
        recipe, found = of_recipe.iloc[0], of_recipe.set_index("property")
        expected = [f"{found['mean'][name]:.3g}\u00a0±\u00a0{found.half_width[name]:.2g}" for name in names]
        rows.append([*recipe[exploration.inputs], *expected])
    return {
        "targets": [(exploration.names[row.property], row.target) for row in wanted.itertuples()],
        "inputs": [input_name(name) for name in exploration.inputs],
        "properties": [exploration.names[name] for name in names],
        "rows": rows,
    }


def recipes(exploration: Exploration) -> Mapping:
    """Rows of the table of all recipes."""
    columns = ["slurry", *exploration.inputs, *exploration.names]
    return {
        "inputs": [input_name(name) for name in exploration.inputs],
        "properties": list(exploration.names.values()),
        "rows": exploration.table[columns].to_numpy().tolist(),
    }


def costs(exploration: Exploration) -> Mapping:
    """Rows of the table of costs, one a stage, and the CPU seconds of a recipe with `direct` alone."""
    table = exploration.costs
    alone = table[(table.surrogate == "direct") | (table.stage == "generate_inputs")]
    rows = table[["stage", "surrogate", "jobs", "particles", "cpu_s", "wall_s"]].to_numpy().tolist()
    return {
        "rows": rows,
        "recipe_cpu_s": float(alone.cpu_s.sum()),
        "total_cpu_s": float((table.cpu_s * table.jobs).sum()),
    }


def sections(exploration: Exploration) -> dict[str, Mapping | None]:
    """What each section of the page gets, in its order."""
    errors = trust(exploration)
    return {
        "summary": summary(exploration) | {"trust": errors},
        "maps": {},
        "target": target(exploration),
        "inputs": inputs(exploration),
        "trust": errors,
        "recipes": recipes(exploration),
        "costs": costs(exploration),
    }
