"""Put the recipes of an exploration and the properties of their tapes into one table, and measure the noise.

In: the table of recipes (CSV), the quantities of each tape (CSV, of measure_microstructure), and the folder of the cost
records.
Out: a table (CSV) of a row for each slurry: slurry, the inputs, each property (empty where a tape has none, such as the
tortuosity of a void without a way through), and <property>_sd, the standard deviation of one slurry as repetitions give
it. One of the properties: property, unit, mean and sd over the different recipes, replica_sd and its degrees of
freedom; repetitions are recipes with equal inputs. And one of the costs: stage, surrogate (- where there is none),
number of jobs, their mean cpu_s, wall_s and number of particles.
"""

from pathlib import Path

import pandas as pd

from slurrycast.config.slurry_table import read_cells
from slurrycast.data.tables import read_table, write_table
from slurrycast.explore.regression import pooled_sd
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import read_cost
from slurrycast.runtime.files import InputError


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--recipes", "table of recipes (CSV)")
    parser.add_input("--tapes", "quantities of each tape (CSV), in the order of the recipes", nargs="+")
    parser.add_value("--properties", "quantities that are looked at", nargs="+")
    parser.add_value("--costs", "folder with the cost records of the run", type=Path)
    parser.add_output("--table", "recipes and properties (CSV)")
    parser.add_output("--noise", "properties and their noise (CSV)")
    parser.add_output("--cost-table", "costs by stage (CSV)")


def properties_of(path: Path, names: list[str]) -> pd.DataFrame:
    """Value and unit of these properties of a tape, by name. InputError if one is missing."""
    table = read_table(path).set_index("quantity")
    for name in names:
        if name not in table.index:
            raise InputError(f"{path}: has no {name}, but {', '.join(table.index)}")
    return table.loc[names, ["value", "unit"]]


def read_recipes(path: Path) -> pd.DataFrame:
    """Slurry and inputs of each recipe of a table that was checked before the run."""
    (_, header), *rows = read_cells(path, ",")[0]
    table = pd.DataFrame([cells for _, cells in rows], columns=header).rename(columns={"id": "slurry"})
    names = table.pop("slurry")
    inputs = table.drop(columns="confirm", errors="ignore").astype(float)
    return pd.concat([names, inputs], axis=1)


def costs(folder: Path, slurries: set[str]) -> pd.DataFrame:
    """Costs of the jobs on these slurries, by stage and surrogate."""
    paths = [path for path in sorted(folder.rglob("*.json")) if not path.name.startswith(".")]  # written meanwhile
    records = pd.DataFrame(map(vars, map(read_cost, paths)))
    groups = records[records.slurry.isin(slurries)].groupby(["stage", "surrogate"])
    means = groups[["cpu_s", "wall_s", "particles"]].mean()
    return means.assign(jobs=groups.size()).reset_index()


def main(args: Namespace) -> None:
    """Read everything and write the tables."""
    recipes = read_recipes(args.recipes)
    tapes = [properties_of(path, args.properties) for path in args.tapes]
    values = pd.DataFrame([tape.value for tape in tapes]).reset_index(drop=True)
    groups = recipes.groupby(list(recipes.columns.drop("slurry")), sort=False).ngroup().to_numpy()
    alone = ~pd.Series(groups).duplicated()
    rows = []
    for name in args.properties:
        known = values[name].notna().to_numpy()
        sd, freedom = pooled_sd(values[name][known].to_numpy(), groups[known])
        of_recipes = values[name][alone]
        spread = {"mean": of_recipes.mean(), "sd": of_recipes.std()}
        rows.append(
            {"property": name, "unit": str(tapes[0].unit[name]), **spread, "replica_sd": sd, "freedom": freedom}
        )
        values[f"{name}_sd"] = sd
    write_table(args.table, recipes.join(values))
    write_table(args.noise, rows)
    write_table(args.cost_table, costs(args.costs, set(recipes.slurry)))


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
