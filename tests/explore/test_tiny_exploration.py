"""A whole exploration of tiny slurries with real LAMMPS, from the design to the page."""

import re
import shutil

import pytest
import yaml

from checkouts import copy_checkout, snakemake
from configurations import load, merged
from html_pages import Page
from slurrycast.data.tables import read_table

pytestmark = pytest.mark.slow

EXPLORE = {
    "ranges": {
        "mass_fraction_NiO": [0.45, 0.55],
        "mass_fraction_8YSZ": [0.32, 0.42],
        "solvent_mass_fraction": [0.5, 0.62],
    },
    "points": 4,
    "replicas": 2,
    "confirmations": 1,
    "particles": 140,
    "thickness_ratio": 1.0,
    "properties": ["green_density", "shrinkage", "tortuosity_z_0.2um"],
    "target": {"shrinkage": 0.3},
}


def write(path, **changes):
    """Write a tiny configuration that explores."""
    of_tapes = {"surrogate": {"names": ["direct"]}, "microstructure": {"tortuosity_spacings_um": [0.2]}}
    base = merged(load("tiny"), of_tapes | {"run": {"name": "few"}, "slurries": "config/slurries_recipe.tsv"})
    base["evaluation"] = {"surrogates": [], "replicated": [], "relaxation_steps": []}
    base["learning"] = {"input_frames": [7]}
    path.write_text(yaml.safe_dump(base | {"explore": EXPLORE | changes}))


def test_from_ranges_to_the_page(tmp_path):
    project = copy_checkout(tmp_path / "project")
    config, results = project / "few.yaml", project / "results" / "few"
    write(config)
    said = snakemake(project, "explore", "--configfile", "few.yaml", fails=True)
    assert "results/few/design.csv: no such file: run snakemake --cores 1 design with this configuration first" in said
    snakemake(project, "design", "--configfile", "few.yaml")
    snakemake(project, "explore", "--configfile", "few.yaml")
    table = read_table(results / "tables" / "explore.csv")
    assert list(table.slurry) == ["P1", "P2", "P3", "P4", "C1", "C2"]
    assert table[EXPLORE["properties"]].notna().all(axis=None)
    assert table.green_density[4] != table.green_density[5]  # other seeds
    confirmed = read_table(results / "tables" / "explore_confirmation.csv")
    assert len(confirmed) == 3 and confirmed.dem.notna().all()
    costs = read_table(results / "tables" / "explore_costs.csv").set_index(["stage", "surrogate"]).jobs
    assert costs["dry_slurry", "direct"] == 6 and costs["run_slurry", "-"] == costs["dry_slurry", "-"] == 1
    assert Page((results / "explore.html").read_text(encoding="utf-8")).images == 2
    # a design that no longer fits its ranges, and one that was edited
    write(config, points=5)
    said = snakemake(project, "explore", "--configfile", "few.yaml", fails=True)
    assert "results/few/design.csv: is not what section explore of the configuration gives now" in said
    own = "it's $(touch x) own.csv"
    shutil.copy(results / "design.csv", project / own)
    (results / "design.csv").write_text((results / "design.csv").read_text().replace("P4,", "Q4,"))
    said = snakemake(project, "explore", "--configfile", "few.yaml", fails=True)
    assert "results/few/design.csv: was edited: save it under another path, and name that in explore.recipes" in said
    write(config, recipes=own)
    said = snakemake(project, "results/few/tables/explore.csv", "--configfile", "few.yaml")
    assert re.findall(r"^rule (\w+):|^localrule (\w+):", said, re.MULTILINE) == [("", "tabulate_points")]
    assert not list(project.rglob("x"))
