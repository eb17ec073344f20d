"""Compare what surrogates are worth on recipes that they were trained on and on others.

In: tables/skill.csv, structure_errors.csv and, where tapes are judged, tape_errors.csv; the recipe and the role of each
held-out slurry (JSON), and the recipes that the surrogates were trained on: those of this run, and of a surrogate whose
model came from elsewhere, its own (JSON, with null where that does not say).
Out: tables/recipes.csv, one row a role, recipe, surrogate and quantity: whether the surrogate was trained on the recipe
(yes, no, unknown), number of slurries, mean, least and greatest value over them, and the mean distance from the DEM in
replica sd. The value is the skill itself; of relaxed structures and of tapes the difference to the DEM, of density and
tape properties in % of the DEM's, of coordinations in contacts; and of an RDF the mean |g - g of the DEM|, in units of
that between replicas. The replica sd is that of the replicated slurries, whatever the recipe. The default recipe is
called "default".
"""

import json
from collections.abc import Iterator, Mapping

import pandas as pd

from slurrycast.data.tables import read_table, write_table
from slurrycast.evaluation.noise import RDF_PREFIX
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

COLUMNS = ("role", "recipe", "trained_on", "surrogate", "quantity", "unit", "slurries", "mean", "least", "greatest")
COLUMNS += ("replica_sds",)
DEFAULT = "default"


def skills(table: pd.DataFrame) -> pd.DataFrame:
    """Rows of tables/skill.csv as `errors` makes those of the others."""
    return pd.DataFrame(
        {"surrogate": table.surrogate, "slurry": table.slurry, "quantity": "skill", "unit": "1", "value": table.skill}
    )


def errors(table: pd.DataFrame, stage: str) -> pd.DataFrame:
    """Rows of tables/structure_errors.csv or tape_errors.csv at one stage: differences to the DEM, see the module."""
    of_structure = ~table.quantity.isin(["particles", "voxel_spacing"])
    table = table[(table.stage == stage) & table.value.notna() & of_structure]
    difference = table.value - table.dem_value
    is_rdf = table.quantity.str.startswith(RDF_PREFIX)
    in_contacts = table.quantity.str.startswith("coordination")
    share = 100 * difference / table.dem_value.where(table.dem_value != 0)
    sds = difference.abs() / table.replica_sd.where(table.replica_sd > 0)
    value = share.where(~(is_rdf | in_contacts), difference).where(~is_rdf, sds)
    unit = pd.Series("%", table.index).where(~in_contacts, "contacts").where(~is_rdf, "replica difference")
    rows = {"surrogate": table.surrogate, "slurry": table.slurry, "quantity": table.quantity, "unit": unit}
    return pd.DataFrame(rows | {"value": value, "replica_sds": sds}).dropna(subset=["value"])


def grouped(
    rows: pd.DataFrame, recipes: Mapping, roles: Mapping, trained: list[str], elsewhere: Mapping[str, list[str | None]]
) -> Iterator[dict]:
    """One row a role, recipe, surrogate and quantity, in the order in which they come.

    `recipes` and `roles` are by slurry, `trained` are the recipes that surrogates were trained on, but for those in
    `elsewhere`, which has their own, and None if there may be others. InputError for a slurry without recipe or role.
    """
    unknown = [slurry for slurry in rows.slurry.unique() if slurry not in recipes or slurry not in roles]
    if unknown:
        raise InputError(f"--recipes, --roles: slurry {unknown[0]} has no recipe or role")
    keys = [rows.slurry.map(roles), rows.slurry.map(recipes), rows.surrogate, rows.quantity, rows.unit]
    for (role, recipe, surrogate, quantity, unit), group in rows.groupby(keys, sort=False):
        known = elsewhere.get(surrogate, trained)
        yield {
            "role": role,
            "recipe": recipe or DEFAULT,
            "trained_on": "yes" if recipe in known else "unknown" if None in known else "no",
            "surrogate": surrogate,
            "quantity": quantity,
            "unit": unit,
            "slurries": len(group),
            "mean": group.value.mean(),
            "least": group.value.min(),
            "greatest": group.value.max(),
            "replica_sds": group.replica_sds.mean(),
        }


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("skill", "structure_errors")
    parser.add_input("--tape-errors", "tables/tape_errors.csv; none where no tapes are judged", required=False)
    parser.add_value("--recipes", 'JSON: recipe of each held-out slurry, "" for the default', type=json.loads)
    parser.add_value("--roles", "JSON: role of each held-out slurry", type=json.loads)
    parser.add_value("--trained", "JSON: list of the recipes that surrogates were trained on", type=json.loads)
    meaning = "JSON: recipes of surrogates whose model is not of this run's training alone, by label; null: others"
    parser.add_value("--elsewhere", meaning, type=json.loads, default={})
    parser.add_output("--table", "table of recipes (CSV)")


def main(args: Namespace) -> None:
    """Group all errors by recipe and write the table."""
    parts = [skills(read_table(args.skill)), errors(read_table(args.structure_errors), "relaxed")]
    if args.tape_errors:
        tapes = read_table(args.tape_errors).rename(columns={"source": "surrogate"})
        tapes = errors(tapes[tapes.surrogate != "dem"], "tape")
        parts.append(tapes.assign(quantity="tape_" + tapes.quantity))
    rows = pd.concat(parts, ignore_index=True).reindex(
        columns=["surrogate", "slurry", "quantity", "unit", "value", "replica_sds"]
    )
    groups = grouped(rows, args.recipes, args.roles, args.trained, args.elsewhere)
    table = pd.DataFrame(groups, columns=COLUMNS)
    write_table(args.table, table, digits=6)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
