"""Tables of docs/transfer.md: each public function gives one."""

import pandas as pd

from reference_results import ROOT, load, of_recipes, read_result, recipe_name, recipes_by_surrogates
from slurrycast.report.names import quantity_name, tape_quantity

TAPE = "tape_"
SHOWN = {  # quantities with the number of decimals
    "density_g_cm3": 2,
    "coordination_all": 3,
    "rdf_all": 2,
    "tape_green_density": 2,
}


def transfer_recipes() -> pd.DataFrame:
    """Recipes of config/transfer.yaml: what differs, and how many slurries of each role."""
    config = load("transfer")
    rows = pd.read_csv(ROOT / config["slurries"], sep="\t", dtype={"formulation": str}, keep_default_na=False)
    default = load("config")["formulation"]["phases"]
    table = []
    for recipe, slurries in rows.groupby("formulation", sort=False):
        phases = config["formulations"][recipe]["phases"] if recipe else default
        shares = " / ".join(f"{100 * phases[name]['mass_fraction']:.3g}" for name in ("NiO", "8YSZ", "BDPD"))
        diameters = [size["diameter_um"] for size in phases["NiO"]["size_classes"]]
        roles = slurries.role.value_counts()
        table.append(
            {
                "recipe": recipe_name(recipe or "default"),
                "NiO / 8YSZ / BDPD (mass %)": shares,
                "NiO diameters (µm)": f"{min(diameters):g} to {max(diameters):g}",
                "slurries": ", ".join(f"{number} {role}" for role, number in roles.items()),
            }
        )
    return pd.DataFrame(table)


def transfer_skill() -> pd.DataFrame:
    """Skill by recipe and surrogate: mean, and least to greatest."""
    rows = of_recipes("skill")
    rows = rows.assign(text=[f"{r.mean:.2f} ({r.least:.2f} to {r.greatest:.2f})" for r in rows.itertuples(index=False)])
    return recipes_by_surrogates(rows, ["recipe", "trained on"])


def transfer_errors() -> pd.DataFrame:
    """Mean errors after relaxation and of tapes, by quantity, recipe and surrogate."""
    parts = []
    for quantity, digits in SHOWN.items():
        rows = of_recipes(quantity)
        name = quantity.removeprefix(TAPE)
        name = f"tape: {tape_quantity(name, '1')}" if quantity.startswith(TAPE) else quantity_name(name)
        unit = {"%": "%", "contacts": "contacts", "replica difference": "replica spreads"}[rows.unit.iloc[0]]
        mean = rows["mean"].map(f"{{:{'' if unit == 'replica spreads' else '+'}.{digits}f}}".format)
        sds = rows.replica_sds.map(" ({:.1f})".format) if unit != "replica spreads" else ""
        parts.append(rows.assign(text=mean + sds, error=f"{name.removesuffix(' (g/cm³)')} ({unit})"))
    return recipes_by_surrogates(pd.concat(parts), ["error", "recipe", "trained on"])


def transfer_tuning() -> pd.DataFrame:
    """Skill by the number of slurries of the recipe, mean and least to greatest."""
    rows = read_result("transfer", "tuning")
    skill = rows.skill.map("{:.2f}".format) + rows.least_skill.map(" ({:.2f} to ".format)
    text = skill + rows.greatest_skill.map("{:.2f})".format)
    start = rows.start.map({"fine_tuned": "fine-tuned", "from_scratch": "from scratch"})
    table = rows.assign(text=text, surrogate="`" + rows.surrogate + "`", training=start)
    table = table.pivot(index=["surrogate", "training"], columns="slurries", values="text")
    table = table.rename(
        columns={number: f"{number} slurr{'y' if number == 1 else 'ies'}" for number in table}
    ).reset_index()
    return table.sort_values(["surrogate", "training"], ascending=[False, True]).rename_axis(columns=None)
