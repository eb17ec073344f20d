"""Networks that are trained on a few slurries of another recipe: the script on small slurries, and its table."""

import json

import numpy as np
import pandas as pd
import pytest

import plot_tuning
from pictures import is_drawn, recorded_calls, texts
from script_runs import run_script, write_costs, written
from slurrycast.data.dataset import assemble
from slurrycast.runtime.costs import Cost, read_cost
from slurrycast.surrogates import vgg16
from structures import frame, particles, write_store

FRAMES = (7, 8, 9, 10, 120)


@pytest.fixture
def options(tmp_path, monkeypatch) -> dict:
    """A slurry to train on and two to predict, of two of three phases, and a stored model."""
    monkeypatch.setattr(vgg16, "BLOCKS", ((4,), (4,)))
    monkeypatch.setattr(vgg16, "DENSE_UNITS", 8)

    def store(name: str, seed: int):
        rng = np.random.default_rng(seed)
        edges_um = {k: np.array([5.0, 5.0, 8.0]) * (1.3 - 0.02 * (k - 7) if k < 120 else 1.0) for k in FRAMES}
        scaled = rng.uniform(-0.5, 0.5, (40, 3))
        frames = [frame(k, (scaled + rng.normal(0, 0.01, (40, 3))) * edges_um[k], edges_um[k]) for k in FRAMES]
        some = particles(rng.integers(1, 3, 40), 0.4, ("NiO", "8YSZ"))
        return write_store(tmp_path / f"{name}.h5", frames, some, slurry=name)

    trained, *predicted = (store(name, seed) for seed, name in enumerate("ABC"))
    vgg16.build(4, 6).save(tmp_path / "model.keras")
    (tmp_path / "noise.csv").write_text(
        "slurry,particles,quantity,runs,mean,sd\n1,40,perturbation_floor_um2,1,0.0001,\n", encoding="utf-8"
    )
    (tmp_path / "packing.json").write_text(json.dumps({"mean": 0.05}))
    files = {
        name: tmp_path / f"{name}.{end}" for name, end in (("noise", "csv"), ("packing", "json"), ("table", "csv"))
    }
    return files | {
        "surrogate": "vgg16",
        "settings": json.dumps({"epochs": 2, "batch_size": 10, "learning_rate": 1e-3, "threads": 1}),
        "seed": 3,
        "frames": [trained],
        "start_from": tmp_path / "model.keras",
        "predicted": predicted,
        "input_frames": [7, 8, 9, 10],
        "target_frame": 120,
        "phases": ["BDPD", "NiO", "8YSZ"],
        "validation_share": 0.2,
        "work": tmp_path / "work",
        "cost": tmp_path / "cost.json",
    }


def test_stored_tuned_and_new_networks_predict_the_same_slurries(options):
    tables = {}
    for name, changes in (("stored", {"frames": []}), ("tuned", {}), ("new", {"start_from": None})):
        asked = {key: value for key, value in (options | changes).items() if value is not None}
        tables[name] = written("tune_surrogate", **asked)
        assert read_cost(options["cost"]).cpu_s > 0 and not options["work"].exists()
    kinds = [(table.start[0], table.slurries[0], list(table.slurry)) for table in tables.values()]
    assert kinds == [("fine_tuned", 0, ["B", "C"]), ("fine_tuned", 1, ["B", "C"]), ("from_scratch", 1, ["B", "C"])]
    for table in tables.values():
        np.testing.assert_allclose(table.skill, 1 - (table.mse_um2 - 1e-4) / (table.mse_affine_um2 - 1e-4), rtol=1e-6)
        np.testing.assert_array_equal(table.mse_affine_um2, tables["stored"].mse_affine_um2)
    assert len({table.mse_um2[0] for table in tables.values()}) == 3
    done = run_script("tune_surrogate", **{k: v for k, v in options.items() if k not in ("frames", "start_from")})
    assert done.returncode == 2 and "--frames or --start-from: at least one is needed" in done.stderr


def test_phases_have_the_numbers_of_all_recipes(options):
    data = assemble(options["frames"], options["phases"], [7, 8, 9, 10], 120, 0.2, 1)
    assert set(data.features[..., 0].ravel()) == {2, 3}


def test_trainings_are_tabulated(tmp_path):
    kind = {"surrogate": "net", "start": "fine_tuned", "slurries": 2}
    rows = [
        kind | {"slurry": s, "mse_um2": m, "mse_affine_um2": 0.4, "skill": 1 - m} for s, m in (("B", 0.1), ("C", 0.3))
    ]
    pd.DataFrame(rows).to_csv(tmp_path / "tuning_1.csv", index=False)
    costs = write_costs(tmp_path, [Cost("tune_surrogate", cpu_s=12.5)])
    (row,) = written(
        "tabulate_tuning", tunings=[tmp_path / "tuning_1.csv"], costs=costs, table=tmp_path / "tuning.csv"
    ).itertuples(index=False)
    assert (row.surrogate, row.start, row.slurries, row.predicted) == ("net", "fine_tuned", 2, 2)
    assert row[4:] == pytest.approx((0.8, 0.7, 0.9, 0.2, 0.4, 12.5))


def test_figure_has_a_panel_for_each_surrogate(tmp_path, monkeypatch):
    rows = [
        (name, start, number, 0.1 * number, 0.1 * number - 0.2, 0.1 * number + 0.1)
        for name in ("vgg16", "neighbours")
        for start in ("fine_tuned", "from_scratch")
        for number in (0, 1, 4)
        if number or start == "fine_tuned"
    ]
    columns = ["surrogate", "start", "slurries", "skill", "least_skill", "greatest_skill"]
    options = {"tuning": tmp_path / "tuning.csv", "figure": tmp_path / "tuning.png"}
    pd.DataFrame(rows, columns=columns).to_csv(options["tuning"], index=False)
    calls = recorded_calls(monkeypatch, plot_tuning, "draw_tuning")
    assert run_script(plot_tuning, **options).returncode == 0
    figure = calls[0][1]
    assert [axes.get_title() for axes in figure.axes] == ["vgg16", "neighbours"]
    for axes in figure.axes:
        tuned, scratch = (container.lines for container in axes.containers)
        np.testing.assert_allclose(tuned[0].get_xydata(), [[-0.04, 0], [0.96, 0.1], [3.96, 0.4]])
        np.testing.assert_allclose(scratch[0].get_xydata(), [[1.04, 0.1], [4.04, 0.4]])
        (bars,) = scratch[2]
        np.testing.assert_allclose([path.vertices[:, 1] for path in bars.get_paths()], [[-0.1, 0.2], [0.2, 0.5]])
    assert texts(figure.legends[0].get_texts()) == ["fine-tuned", "trained from scratch"]
    assert is_drawn(options["figure"])
    pd.DataFrame(columns=columns).to_csv(options["tuning"], index=False)
    assert "no skill in it" in run_script("plot_tuning", **options).stderr
