"""Measured figures that the configurations give as reasons, against the runs that they come from."""

import re

import numpy as np
import pandas as pd
import pytest
import yaml

from slurrycast.equilibrium import equilibrium
from slurrycast.recipe import particle_counts, particle_types


@pytest.fixture
def comments(root):
    """All comments of a configuration as one text."""

    def read(scale: str) -> str:
        text = (root / "config" / f"{scale}.yaml").read_text(encoding="utf-8")
        return " ".join(re.findall(r"# (.*)", text))

    return read


def test_time_step_of_the_demo(root, comments):
    ends = {}
    for timestep in ("2.0e-3", "1.0e-3", "5.0e-4"):
        table = pd.read_csv(root / "results" / "reference" / "timestep" / f"{timestep}.csv")
        ends[timestep] = table[table.role != "new"].density_g_cm3
    means, scatter = [end.mean() for end in ends.values()], [end.std() for end in ends.values()]
    assert "three slurries end at {:.3f}, {:.3f} and {:.3f} g/cm3 on average".format(*means) in comments("config")
    assert f"scatter by {min(scatter):.3f} to {max(scatter):.3f} g/cm3" in comments("config")


def test_barostat_of_the_larger_scales(root, comments):
    runs = {
        scale: pd.read_csv(root / "results" / "reference" / "densification" / f"{scale}_6.csv")
        for scale in ("demo", "reduced")
    }
    config = yaml.safe_load((root / "config" / "config.yaml").read_text())
    types = particle_types(config["formulation"]["phases"])
    counts, dense_us = {}, {}
    for scale in ("demo", "reduced", "full"):
        name = "config" if scale == "demo" else scale
        unit_pg = yaml.safe_load((root / "config" / f"{name}.yaml").read_text())["formulation"]["unit_mass_pg"]
        counts[scale] = int(particle_counts(types, 5 * unit_pg).sum())
    for scale, run in runs.items():
        dense_us[scale] = run.time_us[run.density_g_cm3 >= 2.0].iloc[0]
        said = f"{counts[scale]:,}".replace(",", " ")
        assert re.search(rf"{said} (particles reach 2.0 g/cm3 )?after {dense_us[scale]:g} us", comments("full"))
    ratio = {key: np.log(values["reduced"] / values["demo"]) for key, values in (("n", counts), ("t", dense_us))}
    exponent = ratio["t"] / ratio["n"]
    assert f"N^{exponent:.2f}" in comments("full")
    expected_us = dense_us["reduced"] * (counts["full"] / counts["reduced"]) ** exponent
    assert f"after about {expected_us:.0f} us" in comments("full")
    found = equilibrium(runs["reduced"].time_us.to_numpy(), runs["reduced"].density_g_cm3.to_numpy())
    assert f"from {found.time_to_equilibrium_us:g} us on" in comments("reduced")
