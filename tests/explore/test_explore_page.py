"""Tables and page of an exploration of made-up tapes whose properties are known functions of the inputs."""

import json

import numpy as np
import pandas as pd
import pytest

from html_pages import Page
from pictures import is_drawn
from script_runs import refusal, run_script, write_costs
from slurrycast.data.tables import read_table
from slurrycast.explore.design import design
from slurrycast.explore.inputs import InputSpace
from slurrycast.runtime.costs import Cost

RANGES = {"mass_fraction_glue": (0.1, 0.2), "mass_fraction_A": (0.4, 0.6), "mass_fraction_B": (0.25, 0.45)}
RANGES |= {"size_factor_A": (0.8, 1.2)}
PROPERTIES = ["green_density", "shrinkage", "share_void_union"]
TABLES = ("noise", "models", "left_out", "indices", "nearest", "confirmation", "costs")


def tape(path, recipe, source: str, rng: np.random.Generator):
    """Write a tape: the density falls with the glue, the shrinkage rises with the size, the void is noise."""
    values = {
        "green_density": 4 - 5 * recipe.mass_fraction_glue + 0.01 * rng.normal(),
        "shrinkage": 0.2 + 0.1 * recipe.size_factor_A**2 + 0.001 * rng.normal(),
        "share_void_union": 0.4 + 0.01 * rng.normal(),
    }
    rows = [{"quantity": name, "value": value, "unit": "1"} for name, value in values.items()]
    rows[0]["unit"] = "g/cm3"
    pd.DataFrame(rows).assign(source=source, slurry=recipe.id, stage="tape").to_csv(path, index=False)
    return path


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folder with the tables explore*.csv and the page of 24 recipes and 4 replicas, ids that look like numbers."""
    folder = tmp_path_factory.mktemp("explored")
    table = design(InputSpace.of_ranges(RANGES, 1.0), 24, 4, 2, 1)
    table["id"] = [f"{place:03d}" for place in range(len(table))]
    table.to_csv(folder / "recipes.csv", index=False, encoding="utf-8-sig")
    rng = np.random.default_rng(1)
    direct = [tape(folder / f"{recipe.id}_direct.csv", recipe, "direct", rng) for recipe in table.itertuples()]
    confirmed = table[table.confirm == "yes"]
    dem = [tape(folder / f"{recipe.id}_dem.csv", recipe, "dem", rng) for recipe in confirmed.itertuples()]
    off = read_table(dem[0])
    off.loc[off.quantity == "shrinkage", "value"] += 0.02
    off.to_csv(dem[0], index=False)
    costs = [Cost("dry_slurry", "direct", id, 1000, cpu_s=6.0, wall_s=7.0) for id in table.id]
    (folder / "costs").mkdir()
    costs += [Cost("run_slurry", "-", id, 1000, cpu_s=20.0) for id in table.id]
    write_costs(folder / "costs", [*costs, Cost("x", "-", "other")])
    paths = {f"explore_{name}": folder / f"explore_{name}.csv" for name in TABLES} | {"explore": folder / "explore.csv"}
    noise = {"explore_noise": paths["explore_noise"]}
    maps, fits, page = folder / "explore_maps.png", folder / "explore_fits.png", folder / "explore.html"
    target = json.dumps({"green_density": 3.4, "shrinkage": 0.3})
    calls = {
        "tabulate_points": {
            "recipes": folder / "recipes.csv",
            "tapes": direct,
            "properties": PROPERTIES,
            "costs": folder / "costs",
            "table": paths["explore"],
            "noise": paths["explore_noise"],
            "cost_table": paths["explore_costs"],
        },
        "fit_properties": {"explore": paths["explore"], **noise, "target": target, "seed": 1}
        | {name: paths[f"explore_{name}"] for name in ("models", "left_out", "indices", "nearest")}
        | {"maps": folder / "maps.csv"},
        "confirm_points": {
            "slurries": list(confirmed.id),
            "direct": [folder / f"{id}_direct.csv" for id in confirmed.id],
            "dem": dem,
            **noise,
            "table": paths["explore_confirmation"],
        },
        "plot_maps": {"explore": paths["explore"], **noise, "explore_models": paths["explore_models"]}
        | {"maps": folder / "maps.csv", "figure": maps},
        "plot_fits": {**noise, "explore_left_out": paths["explore_left_out"], "figure": fits},
        "write_explore": {name: path for name, path in paths.items() if name != "explore_left_out"}
        | {"run": "made", "figures": [maps, fits], "page": page},
    }
    for script, options in calls.items():
        done = run_script(script, **options)
        assert done.returncode == 0, done.stderr
    return folder


def test_the_noise_is_that_of_the_replicas_and_costs_are_counted(made):
    table, noise = read_table(made / "explore.csv"), read_table(made / "explore_noise.csv").set_index("property")
    assert list(table.slurry[:2]) == ["000", "001"]
    assert (table.shrinkage_sd == noise.replica_sd["shrinkage"]).all()
    assert noise.replica_sd["shrinkage"] == pytest.approx(table.shrinkage[-4:].std(), rel=1e-6)
    assert (noise.freedom == 3).all()
    costs = read_table(made / "explore_costs.csv").set_index("stage")
    assert dict(costs.jobs) == {"dry_slurry": 28, "run_slurry": 28} and costs.cpu_s["dry_slurry"] == 6.0


def test_inputs_are_found_that_matter(made):
    models, indices = (read_table(made / f"explore_{name}.csv") for name in ("models", "indices"))
    assert list(models.resolved) == ["yes", "yes", "no"]
    first = indices.set_index(["property", "input"]).first_order
    assert first["green_density", "mass_fraction_glue"] > 0.9 and first["shrinkage", "size_factor_A"] > 0.9
    assert {name for _, name in first.index} == {"mass_fraction_glue", "mass_fraction_A", "size_factor_A"}
    nearest = read_table(made / "explore_nearest.csv")
    best = nearest[nearest["rank"] == 1].set_index("property")
    assert (best["mean"] - best.target).abs()[["green_density", "shrinkage"]].max() < 0.01
    assert best.mass_fraction_glue.iloc[0] == pytest.approx((4 - 3.4) / 5, abs=0.005)
    assert nearest[["mass_fraction_glue", "mass_fraction_A", "mass_fraction_B"]].sum(axis=1).round(6).eq(1).all()
    left_out = read_table(made / "explore_left_out.csv")
    assert left_out.groupby("property").size().eq(24).all()  # not the replicas


def test_confirmations_are_judged_by_the_noise(made):
    judged = read_table(made / "explore_confirmation.csv").set_index(["slurry", "property"]).within_band
    first, second = dict.fromkeys(name for name, _ in judged.index)
    assert judged[first, "shrinkage"] == "no" and judged[second, "shrinkage"] == "yes"


def test_the_page_says_what_matters_and_loads_nothing(made):
    page = Page((made / "explore.html").read_text(encoding="utf-8"))
    assert page.loads_nothing and page.images == 2
    assert all(is_drawn(made / f"explore_{name}.png") for name in ("maps", "fits"))
    assert "green density (g/cm³): glue mass fraction (" in page.text
    assert "Not resolved, as the inputs tell little more than the mean: void." in page.text
    assert "One recipe takes 6 CPU s" in page.text
    assert [row[0] for row in page.rows].count("027") == 1


def test_a_property_that_few_tapes_have_is_left_out(made, tmp_path):
    paths = {name: tmp_path / f"{name}.csv" for name in ("models", "left_out", "indices", "nearest", "maps")}
    table = read_table(made / "explore.csv")
    table.loc[4:, "shrinkage"] = np.nan
    table.to_csv(tmp_path / "explore.csv", index=False)
    explore, noise = {"explore": tmp_path / "explore.csv"}, {"explore_noise": made / "explore_noise.csv"}
    target = json.dumps({"green_density": 3.4, "shrinkage": 0.3})
    done = run_script("fit_properties", **explore, **noise, target=target, seed=1, **paths)
    assert "shrinkage: left out, since it is known of 4 recipes" in done.stdout
    assert list(read_table(paths["models"]).property) == ["green_density", "share_void_union"]
    fits, page = tmp_path / "fits.png", tmp_path / "explore.html"
    done = run_script("plot_fits", **noise, explore_left_out=paths["left_out"], figure=fits)
    assert done.returncode == 0, done.stderr
    of_page = {f"explore_{name}": paths[name] for name in ("models", "indices", "nearest")}
    of_page |= {"explore_costs": made / "explore_costs.csv", "figures": [fits, made / "explore_maps.png"]}
    done = run_script("write_explore", run="made", **explore, **noise, **of_page, page=page)
    assert done.returncode == 0, done.stderr
    assert (
        "Left out, as too few recipes have a value: shrinkage of the thickness."
        in Page(page.read_text(encoding="utf-8")).text
    )
    table.assign(green_density=np.nan, share_void_union=np.nan).to_csv(tmp_path / "explore.csv", index=False)
    done = run_script("fit_properties", **explore, **noise, seed=1, **paths)
    assert "each property is known of too few recipes to fit" in done.stderr


def test_a_property_that_a_tape_does_not_have(made, tmp_path):
    options = {"recipes": made / "recipes.csv", "tapes": [made / "000_direct.csv"], "properties": ["porosity"]}
    outputs = {"costs": made / "costs", "noise": tmp_path / "n.csv", "cost_table": tmp_path / "c.csv"}
    said = refusal("tabulate_points", tmp_path / "t.csv", **options, **outputs)
    assert "000_direct.csv: has no porosity, but green_density, shrinkage, share_void_union" in said
