"""Numbers in the README against the files that the workflow wrote."""

import json
import re

import pandas as pd
import pytest

from slurrycast.tables import read_equilibrium


@pytest.fixture
def reference(root):
    return root / "results" / "reference" / "demo"


def rows(text: str) -> dict[str, list[str]]:
    """Rows of the results table by slurry."""
    lines = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in text.splitlines() if "|" in line]
    return {cells[0]: cells[1:] for cells in lines if re.fullmatch(r"\d", cells[0])}


def test_results_table(root, reference):
    tables = {path.stem: pd.read_csv(path, dtype={"slurry": str}) for path in (reference / "tables").glob("*.csv")}
    density, errors, rdf = (tables[name] for name in ("density_volume", "coordinate_errors", "rdf_errors"))
    dem = density[density.model == "DEM"].set_index("slurry").density_g_cm3
    hybrid = density[density.model == "hybrid"].set_index("slurry").density_g_cm3
    errors = errors[errors.axis == "all"].set_index("slurry")
    rdf = rdf[rdf.pair == "all"].set_index("slurry").mean_abs_difference
    cost = tables["speedup"][tables["speedup"].clock == "wall_s"].set_index("slurry")
    equilibrium = read_equilibrium(reference / "tables" / "equilibrium.csv").set_index("slurry")
    expected = {
        slurry: [
            f"{equilibrium.particles[slurry]:,}",
            f"{dem[slurry]:.3f}",
            f"{hybrid[slurry]:.3f} ({hybrid[slurry] / dem[slurry] - 1:+.1%})",
            f"{errors.mse_um2[slurry]:.3f}",
            f"{errors.r2[slurry]:.4f}",
            f"{rdf[slurry]:.3f}",
            f"{cost.ratio[slurry]:.1f} ({cost.ratio_to_equilibrium[slurry]:.1f})",
        ]
        for slurry in errors.index
    }
    shown = rows((root / "README.md").read_text(encoding="utf-8"))
    assert shown == expected


def test_machine_and_training_time(root, reference):
    text = re.sub(r"\s+", " ", (root / "README.md").read_text(encoding="utf-8"))
    versions = json.loads((reference / "versions.json").read_text())
    assert re.sub(r", \d+ GiB$", "", versions["machine"]) in text
    cost = pd.read_csv(reference / "tables" / "cost.csv")
    minutes = cost[cost.stage == "train_surrogate"].wall_s.iloc[0] / 60
    assert f"Training, {minutes:.1f} min" in text
    cpu_s = cost[cost.stage != "run_slurry_to_input"].cpu_s.sum()
    assert f"it needed {cpu_s / 60:.0f} minutes of CPU time" in text
