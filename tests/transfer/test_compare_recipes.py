"""Recipes trained on and not: the script on a few rows."""

import json

import pandas as pd
import pytest

from script_runs import refusal, written


@pytest.fixture
def options(tmp_path) -> dict:
    """Tables of two surrogates on three slurries, two of them of a recipe that is not trained on."""
    slurries, surrogates = ["1", "2", "3"], ["affine", "net"]
    skills = [(name, slurry, 0.1 * int(slurry) * (name == "net")) for name in surrogates for slurry in slurries]
    pd.DataFrame(skills, columns=["surrogate", "slurry", "skill"]).to_csv(tmp_path / "skill.csv", index=False)
    structures = [
        (name, slurry, stage, quantity, value + int(slurry) * scale, value, sd)
        for name in surrogates
        for slurry in slurries
        for stage in ("predicted", "relaxed")
        for quantity, value, scale, sd in (
            ("particles", 100, 0, 0),
            ("density_g_cm3", 2.0, 0.02, 0.01),
            ("coordination_all", 6.0, 0.1, 0.05),
            ("rdf_NiO-8YSZ", 0.0, 0.1, 0.1),
        )
    ]
    columns = ["surrogate", "slurry", "stage", "quantity", "value", "dem_value", "replica_sd"]
    table = pd.DataFrame(structures, columns=columns)
    table.to_csv(tmp_path / "structure_errors.csv", index=False)
    tapes = table[table.quantity == "density_g_cm3"]
    tapes = pd.concat([tapes.assign(quantity=name) for name in ("green_density", "contacts_ceramic", "voxel_spacing")])
    tapes = pd.concat([tapes, tapes[tapes.surrogate == "net"].assign(surrogate="dem")])
    tapes = tapes.replace({"stage": {"relaxed": "tape"}}).rename(columns={"surrogate": "source"})
    tapes.to_csv(tmp_path / "tape_errors.csv", index=False)
    return {
        "skill": tmp_path / "skill.csv",
        "structure_errors": tmp_path / "structure_errors.csv",
        "tape_errors": tmp_path / "tape_errors.csv",
        "recipes": json.dumps({"1": "", "2": "coarse", "3": "coarse"}),
        "roles": json.dumps(dict.fromkeys(slurries, "test")),
        "trained": json.dumps([""]),
        "table": tmp_path / "recipes.csv",
    }


def test_errors_are_grouped_by_recipe(options):
    rows = written("compare_recipes", **options)
    assert len(rows) == 2 * 2 * 6  # recipes, surrogates, quantities
    assert dict(zip(rows.recipe, rows.trained_on, strict=True)) == {"default": "yes", "coarse": "no"}
    for known, expected in ((["coarse"], ["no", "yes"]), ([None], ["unknown"] * 2), (["", None], ["yes", "unknown"])):
        of_net = written("compare_recipes", **options, elsewhere=json.dumps({"net": known}))
        trained_on = of_net.groupby(["surrogate", "recipe"]).trained_on.unique()
        assert [trained_on["net", recipe].tolist() for recipe in ("default", "coarse")] == [[each] for each in expected]
        assert [trained_on["affine", recipe].tolist() for recipe in ("default", "coarse")] == [["yes"], ["no"]]
    coarse = rows[(rows.recipe == "coarse") & (rows.surrogate == "net")].set_index("quantity")
    assert set(coarse.slurries) == {2}
    expected = {
        "skill": ("1", 0.25, 0.2, 0.3),
        "density_g_cm3": ("%", 2.5, 2.0, 3.0),
        "coordination_all": ("contacts", 0.25, 0.2, 0.3),
        "rdf_NiO-8YSZ": ("replica difference", 2.5, 2.0, 3.0),
        "tape_green_density": ("%", 2.5, 2.0, 3.0),
        "tape_contacts_ceramic": ("%", 2.5, 2.0, 3.0),  # a number in a volume, not of a particle
    }
    for quantity, (unit, *values) in expected.items():
        assert coarse.unit[quantity] == unit
        assert coarse.loc[quantity, ["mean", "least", "greatest"]].tolist() == pytest.approx(values)
    assert coarse.replica_sds.drop("skill").tolist() == pytest.approx([5.0, 5.0, 2.5, 5.0, 5.0])
    assert pd.isna(coarse.replica_sds["skill"])


def test_tapes_may_be_missing_and_a_slurry_needs_a_recipe(options):
    options.pop("tape_errors")
    rows = written("compare_recipes", **options)
    assert not rows.quantity.str.startswith("tape_").any()
    options["table"].unlink()
    said = refusal("compare_recipes", **options | {"recipes": json.dumps({"1": ""})})
    assert said == "error: --recipes, --roles: slurry 2 has no recipe or role\n"
