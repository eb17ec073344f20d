"""Fit each property of the tapes over the inputs of their recipes: errors, inputs that matter, maps, nearest recipes.

In: tables/explore.csv and tables/explore_noise.csv.
Out: tables (CSV), without a property that is known of too few recipes.
- models: for each property, loo_rmse, the root mean square error at points left out, and its ratio to replica_sd and to
  sd; the share of the points within their 90 % interval, as the Gaussian process gives it and calibrated on the other
  points; resolved, whether the error is clearly below sd; and sd_factor, by which the intervals of maps and nearest
  recipes are wider.
- left_out: slurry, property, value, expected from the other points and half width of its calibrated 90 % interval.
- indices: property, input, first_order and total index (Sobol). A mass fraction stands for its share of what those
  before it leave; the last one has none.
- maps: property, the two inputs with the highest total index, their values, mean and half width of the 90 % interval.
- nearest: rank and inputs of the recipes expected nearest to the target, and of each property the mean, the half width
  and the target. Nearness counts each property in units of its sd over the recipes. Without a target it has no rows.
"""

import json

import numpy as np
import pandas as pd

from slurrycast.data.tables import read_table, write_table
from slurrycast.explore.inputs import InputSpace, sobol_points
from slurrycast.explore.maps import grid
from slurrycast.explore.regression import Regression, coverage, fit, normal_quantile
from slurrycast.explore.sensitivity import sobol_indices
from slurrycast.explore.targets import CANDIDATES, nearest
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

RESOLVED_BELOW = 0.8  # of the sd between recipes: an error near it says that the inputs tell nothing


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("explore", "explore_noise")
    parser.add_value("--target", "JSON: wanted value of some properties", type=json.loads, default={})
    parser.add_value("--recipes", "number of recipes nearest to the target", type=int, default=5)
    parser.add_value("--seed", "seed of the fits and samples", type=int)
    for name in ("models", "left-out", "indices", "maps", "nearest"):
        parser.add_output(f"--{name}", "table (CSV)")


def model_row(name: str, values: np.ndarray, alone: np.ndarray, model: Regression, noise: pd.Series) -> dict:
    """Row of the table of models; `alone` (n,) is the mask of the points that are judged."""
    rmse = float(np.sqrt(np.mean((values - model.left_out)[alone] ** 2)))
    as_given, calibrated = coverage(values[alone], model.left_out[alone], model.left_out_sd[alone])
    return {
        "property": name,
        "points": int(alone.sum()),
        "loo_rmse": rmse,
        "replica_sd": noise.replica_sd,
        "loo_over_replica_sd": rmse / noise.replica_sd if noise.replica_sd > 0 else np.nan,
        "loo_over_sd": rmse / noise.sd if noise.sd > 0 else np.nan,
        "resolved": "yes" if rmse < RESOLVED_BELOW * noise.sd else "no",
        "coverage_90": as_given,
        "coverage_90_calibrated": calibrated,
        "sd_factor": model.sd_factor,
    }


def map_rows(name: str, space: InputSpace, model: Regression, totals: np.ndarray) -> pd.DataFrame:
    """Rows of the map of a property over the two inputs with the highest total indices (coordinates,)."""
    order = np.argsort(-totals, kind="stable")
    first, second = (space.coordinates[place] for place in (order[0], order[min(1, len(order) - 1)]))
    inputs, inside = grid(space, first, second)
    mean, half = model.interval(space.scaled(inputs))
    x, y = (inputs[:, space.names.index(axis)] for axis in (first, second))
    columns = {"property": name, "x_input": first, "y_input": second, "x": x, "y": y}
    return pd.DataFrame(
        columns | {"mean": np.where(inside, mean, np.nan), "half_width": np.where(inside, half, np.nan)}
    )


def nearest_recipes(
    space: InputSpace, models: dict[str, Regression], target: dict[str, float], sd: pd.Series, count: int, seed: int
) -> pd.DataFrame:
    """Rows of the recipes expected nearest to the target; `sd` of the properties by name."""
    unit = sobol_points(CANDIDATES, len(space.coordinates), seed)
    inputs = space.at(unit)
    expected = {name: model.interval(space.scaled(inputs)) for name, model in models.items()}
    distance = sum(((expected[name][0] - value) / (sd[name] or 1)) ** 2 for name, value in target.items())
    rows = []
    for rank, place in enumerate(nearest(np.sqrt(distance / len(target)), unit, count), 1):
        for name, (mean, half) in expected.items():
            found = {"property": name, "mean": mean[place], "half_width": half[place], "target": target.get(name)}
            rows.append({"rank": rank, **dict(zip(space.names, inputs[place], strict=True)), **found})
    return pd.DataFrame(rows)


def main(args: Namespace) -> None:
    """Fit all properties and write the tables."""
    table, noise = read_table(args.explore), read_table(args.explore_noise).set_index("property")
    measured = {*noise.index, *(f"{name}_sd" for name in noise.index), "slurry"}
    inputs = [column for column in table if column not in measured]
    space = InputSpace.of_table(table, inputs)
    points = space.scaled(table[list(space.names)].to_numpy())
    repeated = table.duplicated(inputs, keep=False).to_numpy()
    models, rows, left_out, indices, maps = {}, [], [], [], []
    for name in noise.index:
        values = table[name].to_numpy(dtype=float)
        known = np.isfinite(values)
        alone = (known & ~repeated)[known]
        if alone.sum() < len(space.coordinates) + 2:
            print(f"{name}: left out, since it is known of {alone.sum()} recipes that occur once: too few to fit")
            continue
        values = values[known]
        models[name] = model = fit(points[known], values, alone, args.seed)
        rows.append(model_row(name, values, alone, model, noise.loc[name]))
        half = normal_quantile() * model.sd_factor * model.left_out_sd
        found = {
            "slurry": table.slurry[known],
            "property": name,
            "value": values,
            "expected": model.left_out,
            "half_width": half,
        }
        left_out.append(pd.DataFrame(found)[alone])
        first, total = sobol_indices(
            lambda unit, model=model: model.mean(space.scaled(space.at(unit))), points.shape[1], args.seed
        )
        shares = {"property": name, "input": space.coordinates, "first_order": first, "total": total}
        indices.append(pd.DataFrame(shares))
        maps.append(map_rows(name, space, model, total))
        print(f"{name}: {rows[-1]['loo_rmse']:.3g} at points left out, {noise.sd[name]:.3g} between recipes")
    if not models:
        raise InputError(f"{args.explore}: each property is known of too few recipes to fit")
    write_table(args.models, rows)
    write_table(args.left_out, pd.concat(left_out))
    write_table(args.indices, pd.concat(indices))
    write_table(args.maps, pd.concat(maps))
    columns = ["rank", *space.names, "property", "mean", "half_width", "target"]
    target = {name: value for name, value in args.target.items() if name in models}
    found = nearest_recipes(space, models, target, noise.sd, args.recipes, args.seed) if target else []
    write_table(args.nearest, found, columns)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
