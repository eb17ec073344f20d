"""Tables of tapes on cases with a known answer, and the figure of the drying."""

import numpy as np
import pandas as pd
import pytest

from script_runs import run_script, written

PARTICLES = {"1": 1000, "2": 4000, "3": 1000, "N": 500}


def microstructure(path, source, slurry, **values):
    """Write a table as measure_microstructure does."""
    particles = PARTICLES[slurry.split("_")[0]]
    names = {"source": source, "slurry": slurry, "stage": "tape"}
    rows = [names | {"quantity": "particles", "value": particles, "unit": "1"}]
    rows += [names | {"quantity": name, "value": value, "unit": "1"} for name, value in values.items()]
    pd.DataFrame(rows).to_csv(path, index=False)
    return path


@pytest.fixture
def table(tmp_path):
    """tables/microstructure.csv: `far` is off by 10 sd in `void` and not at all in `green`; slurry N has no DEM."""
    paths = []
    for slurry, value, off in (("1", 5.0, 1.0), ("2", 6.0, 0.5), ("3", 7.0, 1.1)):
        paths.append(microstructure(tmp_path / f"dem_{slurry}.csv", "dem", slurry, void=value, green=1.0))
        paths.append(microstructure(tmp_path / f"far_{slurry}.csv", "far", slurry, void=value + off, green=1.0))
    paths.append(microstructure(tmp_path / "far_N.csv", "far", "N", void=1.0, green=1.0))
    out = tmp_path / "microstructure.csv"
    assert run_script("tabulate_microstructure", microstructures=paths, table=out).returncode == 0
    return out


def test_every_tape_stands_beside_that_of_the_dem(table):
    rows = pd.read_csv(table, dtype={"slurry": str}).set_index(["source", "slurry", "quantity"])
    assert rows.dem_value["far", "2", "void"] == rows.dem_value["dem", "2", "void"] == 6.0
    assert np.isnan(rows.dem_value["far", "N", "void"])


def test_tapes_are_judged_by_the_scatter_of_replicas(table, tmp_path):
    replicas = [
        microstructure(
            tmp_path / f"r{number}.csv", "dem", f"1_r{number}", void=5 + 0.1 * number, green=1 + 0.01 * number
        )
        for number in (1, 2, 3)
    ]
    errors = written("compare_tapes", microstructure=table, replicas=replicas, table=tmp_path / "tape_errors.csv")
    assert set(errors.slurry) == {"1", "2", "3"} and set(errors.surrogate) == {"far"}
    sd = errors.set_index(["slurry", "quantity"]).replica_sd
    assert sd["1", "void"] == pytest.approx(0.1) and sd["2", "void"] == pytest.approx(0.05)
    options = {"tape_errors": tmp_path / "tape_errors.csv", "table": tmp_path / "tape_verdicts.csv"}
    verdicts = written("judge_tapes", slurries=["1", "2", "3"], **options).set_index("measure").verdict
    assert dict(verdicts) == {"void": "differs", "green": "equivalent"}


def test_drying_is_drawn(tmp_path):
    rows = {"solvent_left": [1, 0.5, 0, 0], "thickness_um": [9, 8, 7, 6], "density_g_cm3": [2.2, 2.5, 2.8, 3.0]}
    pd.DataFrame(rows | {"packing_fraction": [0.66, 0.63, 0.6, 0.62]}).to_csv(tmp_path / "drying.csv", index=False)
    figure = tmp_path / "drying.png"
    done = run_script("plot_drying", sources=["dem", "direct"], drying=[tmp_path / "drying.csv"] * 2, figure=figure)
    assert (done.returncode, done.stderr) == (0, "")
    assert figure.stat().st_size > 5000
