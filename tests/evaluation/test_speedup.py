"""What the hybrid chain costs end to end, against made-up runs whose costs are known."""

import argparse

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

import compare_article_costs
from script_runs import write_costs, written
from slurrycast.evaluation.power_law import power_law
from slurrycast.evaluation.speedup import (
    HYBRID_PARTS,
    compare_costs,
    exponent,
    extraction_seconds,
    label_and_steps,
    scaling,
    slurries_to_pay,
)
from slurrycast.runtime.costs import Cost
from slurrycast.runtime.files import InputError

HYBRID_S = {"predict_slurry": 2.0, "wrap_slurry": 1.0, "relax_slurry": 12.0}
SECONDS = st.floats(0, 1e4)


def dem_run(last_frame: int = 120) -> dict:
    """Content of run.json of a run of 10 steps a frame: 0.1 s a step up to frame 60, 0.2 s after it."""
    segments = [
        {"step_start": first, "step_end": last, "wall_s": seconds, "cpu_s": seconds / 2}
        for first, last, seconds in ((0, 600, 60.0), (600, 1200, 120.0))
    ]
    run = {"start": {"wall_s": 3.0, "cpu_s": 1.5}, "segments": segments, "steps": 1200, "frames_written": 121}
    if last_frame < 120:
        short = {"step_start": 0, "step_end": 10 * last_frame, "wall_s": float(last_frame), "cpu_s": last_frame / 2}
        run |= {"segments": [short], "steps": 10 * last_frame, "frames_written": last_frame + 1}
    return run


RUNS = {"2": dem_run(), "6": dem_run(), "N1": dem_run(10), "T1": dem_run()}
EQUILIBRIUM = pd.DataFrame(
    {
        "slurry": list(RUNS),
        "role": ["test", "test", "new", "train"],
        "particles": [100, 400, 300, 100],
        "time_to_equilibrium_us": [60.0, 60.0, np.nan, 60.0],
        "run_time_us": [120.0, 120.0, 10.0, 120.0],
        "warning": ["", "not in equilibrium", "", ""],
    }
)


ROLES = dict(zip(EQUILIBRIUM.slurry, EQUILIBRIUM.role, strict=True))


def cost_table(labels: tuple[str, ...] = ("net", "net_f02")) -> pd.DataFrame:
    """Rows of tables/cost.csv; CPU seconds are half of the wall seconds."""
    rows = [("train_surrogate", "net", "-", 500.0), ("assemble_dataset", "-", "-", 4.0)]
    for slurry, run in RUNS.items():
        dem_s = run["start"]["wall_s"] + sum(segment["wall_s"] for segment in run["segments"])
        rows += [("generate_inputs", "-", slurry, 0.5), ("run_slurry", "-", slurry, dem_s)]
        rows.append(("extract_frames", "-", slurry, 1.0 + 0.1 * run["frames_written"]))
        rows += [(stage, label, slurry, s) for label in labels for stage, s in HYBRID_S.items() if slurry != "T1"]
    table = pd.DataFrame(rows, columns=["stage", "surrogate", "slurry", "wall_s"])
    particles = table.slurry.map(EQUILIBRIUM.set_index("slurry").particles)
    return table.assign(particles=particles, cpu_s=table.wall_s / 2)


STEPS = {"net": 100, "net_f02": 20}
# of 121 frames, 11 or 3 are needed, and the cheapest extraction is that of the new slurry
EXTRACTION_S = {"net": 2.1 + 11 / 121 * 13.1, "net_f02": 2.1 + 3 / 121 * 13.1}


def test_the_hybrid_pays_for_everything_up_to_its_own_last_input_frame():
    rows = compare_costs(cost_table(), EQUILIBRIUM, RUNS, STEPS).set_index(["surrogate", "slurry"])
    assert list(rows.index) == [(label, slurry) for label in STEPS for slurry in ("2", "6", "N1")]
    for label, dem_s in (("net", 3.0 + 10.0), ("net_f02", 3.0 + 2.0)):
        row = rows.loc[label, "2"]
        parts = {"generate_inputs": 0.5, "run_slurry_to_input": dem_s, "extract_frames": EXTRACTION_S[label]}
        assert row[list(HYBRID_PARTS)].to_dict() == pytest.approx(parts | HYBRID_S)
        assert row.hybrid == pytest.approx(0.5 + dem_s + EXTRACTION_S[label] + 15.0)
        assert row.ratio == pytest.approx(row.dem / row.hybrid)
        # the DEM needs its inputs as well, and is flat half-way
        assert (row.dem, row.dem_to_equilibrium) == pytest.approx((183.5, 63.5))
    assert np.isnan(rows.loc[("net", "6"), ["dem_to_equilibrium", "ratio_to_equilibrium"]].astype(float)).all()
    new = rows.loc["net", "N1"]
    assert np.isnan(new[["dem", "dem_to_equilibrium", "ratio"]].astype(float)).all()
    assert new.extract_frames == pytest.approx(2.1)  # all of its frames are needed


def test_a_slurry_without_a_dem_costs_its_chain():
    """As of a surrogate that takes no frames; for any other one the DEM is missing."""
    costs = cost_table(("direct",)).query("slurry == 'N1' and stage not in ('run_slurry', 'extract_frames')")
    (row,) = compare_costs(costs, EQUILIBRIUM[:0], {}, {"direct": 0}).to_dict("records")
    assert (row["slurry"], row["particles"], row["hybrid"]) == ("N1", 300, pytest.approx(15.5))
    assert np.isnan([row["dem"], row["dem_to_equilibrium"], row["ratio"], row["ratio_to_equilibrium"]]).all()
    with pytest.raises(InputError, match="surrogate direct, slurry N1: no cost of run_slurry_to_input, extract_frames"):
        compare_costs(costs, EQUILIBRIUM[:0], {}, {"direct": 100})


def test_a_tape_costs_its_drying_and_its_measures_from_either_way():
    costs = cost_table()
    record = costs[(costs.stage == "relax_slurry") & (costs.slurry == "2")].iloc[[0]]
    tapes = [
        record.assign(surrogate=label, stage=stage, wall_s=seconds)
        for label, drying in (("net", 3.0), ("-", 4.0))
        for stage, seconds in (("dry_slurry", drying), ("measure_microstructure", 1.0), ("measure_microstructure", 1.5))
    ]
    rows = compare_costs(pd.concat([costs, *tapes]), EQUILIBRIUM, RUNS, STEPS).set_index(["surrogate", "slurry"])
    with_tape, without = rows.loc["net", "2"], rows.loc["net", "6"]
    assert (with_tape.dry_slurry, with_tape.measure_microstructure) == (3.0, 2.5)
    assert with_tape.hybrid_to_tape == pytest.approx(with_tape.hybrid + 5.5)
    assert with_tape.dem_to_tape == pytest.approx(with_tape.dem + 6.5)
    assert with_tape.ratio_to_tape == pytest.approx(with_tape.dem_to_tape / with_tape.hybrid_to_tape)
    assert np.isnan(without[["dry_slurry", "hybrid_to_tape", "dem_to_tape", "ratio_to_tape"]].astype(float)).all()


def test_clocks_are_kept_apart():
    wall, cpu = (compare_costs(cost_table(), EQUILIBRIUM, RUNS, STEPS, clock) for clock in ("wall_s", "cpu_s"))
    np.testing.assert_allclose(cpu.hybrid, wall.hybrid / 2)
    np.testing.assert_allclose(cpu.ratio, wall.ratio)


def test_a_cost_that_is_missing_is_not_taken_for_nothing():
    costs = cost_table()
    without = costs[~((costs.stage == "wrap_slurry") & (costs.slurry == "6"))]
    with pytest.raises(InputError, match="surrogate net, slurry 6: no cost of wrap_slurry"):
        compare_costs(without, EQUILIBRIUM, RUNS, STEPS)
    with pytest.raises(InputError, match="surrogate net_f02: no step of the last input frame"):
        compare_costs(costs, EQUILIBRIUM, RUNS, {"net": 100})


@given(start_s=SECONDS, frame_s=SECONDS, cheapest_frames=st.integers(0, 121), frame=st.integers(0, 120))
def test_extraction_is_bounded_by_the_truth_and_by_the_record(start_s, frame_s, cheapest_frames, frame):
    recorded = start_s + 121 * frame_s
    counted = extraction_seconds(recorded, start_s + cheapest_frames * frame_s, dem_run(), 10 * frame)
    assert counted <= recorded
    assert counted >= (start_s + (frame + 1) * frame_s) * (1 - 1e-12)


def test_exponent_is_that_of_the_power_law():
    particles, seconds = np.array([600, 700, 1200, 1800, 3000]), np.array([5.0, 4.0, 11.0, 12.0, 30.0])
    assert exponent(particles, seconds) == power_law(particles, seconds)


def test_a_surrogate_that_takes_nothing_from_the_dem_pays_nothing_for_it():
    table = compare_costs(cost_table(), EQUILIBRIUM, RUNS, {"net": 0, "net_f02": 20})
    free = table[table.surrogate == "net"]
    assert len(free) and (free.run_slurry_to_input == 0).all() and (free.extract_frames == 0).all()
    assert (table[table.surrogate == "net_f02"].run_slurry_to_input > 0).all()


@pytest.mark.parametrize("particles", [[600, 600, 600], [600, 700, 1199], [600, 3000]])
def test_too_few_or_too_similar_sizes_have_no_exponent(particles):
    assert np.isnan(exponent(np.array(particles), np.arange(1.0, len(particles) + 1))).all()


def test_slurries_that_pay_back():
    assert slurries_to_pay(100.0, 25.0) == 4
    assert slurries_to_pay(101.0, 25.0) == 5
    assert slurries_to_pay(0.0, -1.0) == 0
    assert np.isnan(slurries_to_pay(100.0, -1.0))
    assert np.isnan(slurries_to_pay(np.nan, 25.0))


def test_scaling():
    speedup = pd.DataFrame(
        {
            "surrogate": ["net"] * 4 + ["early_dem_x2"] * 2,
            "slurry": ["2", "6", "N1", "V1", "2", "6"],
            "clock": "wall_s",
            "particles": [100, 400, 300, 1600, 100, 400],
            "hybrid": [10.0, 20.0, 1e6, 40.0, 150.0, 700.0],
            "dem": [100.0, 400.0, np.nan, 1600.0, 100.0, 400.0],
        }
    )
    roles = ROLES | {"V1": "validation"}
    rows = scaling(speedup, cost_table(), roles, {"net"}).set_index("surrogate")
    net, early = rows.loc["net"], rows.loc["early_dem_x2"]
    assert (net.slurries, net.clock, net.fewest_particles, net.most_particles) == (3, "wall_s", 100, 1600)
    assert (net.hybrid_exponent, net.dem_exponent) == pytest.approx((0.5, 1.0))
    assert (net.hybrid_exponent_se, net.dem_exponent_se) == pytest.approx((0, 0), abs=1e-9)
    training_dem_s = 0.5 + 183.0 + 13.1 + 4.0
    # 90 and 380 s of the test slurries
    assert (net.training_s, net.training_dem_s, net.saved_s_per_slurry) == pytest.approx((500, training_dem_s, 235))
    assert (net.slurries_to_pay_training, net.slurries_to_pay_training_and_dem) == (3, 3)
    assert (early.training_s, early.training_dem_s, early.slurries_to_pay_training_and_dem) == (0, 0, 0)
    assert early.saved_s_per_slurry == pytest.approx(-175)
    assert rows.hybrid_exponent.isna().tolist() == [False, True]

    adopted = scaling(speedup, cost_table(), roles, {"net"}, {"net"})
    for column in ("training_s", "training_dem_s", "slurries_to_pay_training_and_dem"):
        assert adopted[column].isna().tolist() == [True, False]


def test_a_training_slurry_without_a_record_is_not_taken_for_nothing():
    speedup = compare_costs(cost_table(), EQUILIBRIUM, RUNS, STEPS)
    costs = cost_table()
    without = costs[~((costs.stage == "run_slurry") & (costs.slurry == "T1"))]
    with pytest.raises(InputError, match="training slurry T1: no cost of run_slurry"):
        scaling(speedup, without, ROLES, {"net"})
    assert scaling(speedup, without, ROLES, set()).training_dem_s.tolist() == [0, 0]


def test_steps_of_the_command_line():
    assert label_and_steps("affine_f02=1000") == ("affine_f02", 1000)
    for word in ("affine", "=1000", "affine=", "affine=1e3", "affine=-5"):
        with pytest.raises(argparse.ArgumentTypeError, match="must be label=steps"):
            label_and_steps(word)


def test_terms_of_the_reference_article():
    own = compare_costs(cost_table(("net",)), EQUILIBRIUM, RUNS, STEPS).dropna(subset=["dem"])
    rows = compare_article_costs.terms(own).set_index("term")
    assert rows.article["full DEM / hybrid"] == 41
    # 1230 min for 6 000 000 steps: the 500 000 up to the last input frame would be 102.5 min
    assert rows.article["the same with the DEM to the last input frame"] == pytest.approx(1230 / 132.5)
    assert rows.ours["full DEM"] == pytest.approx(183.5 / 60)
    hybrid_s = 0.5 + 13.0 + EXTRACTION_S["net"] + 15.0
    assert rows.ours["full DEM / hybrid"] == pytest.approx(183.5 / hybrid_s)
    assert rows.ours["the same without the DEM to the last input frame"] == pytest.approx(183.5 / (hybrid_s - 13))
    assert rows.ours["DEM to equilibrium / hybrid"] == pytest.approx(63.5 / hybrid_s)
    shares = rows.ours[rows.index.str.startswith("share of hybrid: ")]
    assert len(shares) == len(HYBRID_PARTS)
    assert shares.sum() == pytest.approx(100)
    assert shares["share of hybrid: relaxation"] == pytest.approx(100 * 12 / hybrid_s)


def test_the_tables_are_written(tmp_path):
    """compare_costs, fit_costs and compare_article_costs, one after the other."""
    paths = {name: tmp_path / f"{name}.csv" for name in ("cost_table", "equilibrium", "speedup")}
    cost_table().to_csv(paths["cost_table"], index=False)
    EQUILIBRIUM.to_csv(paths["equilibrium"], index=False)
    runs = []
    for slurry, run in RUNS.items():
        runs.append(tmp_path / f"{slurry}.json")
        pd.Series(run | {"slurry": slurry}).to_json(runs[-1])
    records = write_costs(tmp_path, [Cost(**row) for row in cost_table().to_dict("records")])
    equilibrium = paths["equilibrium"]
    of_runs = {"equilibrium": equilibrium, "run_json": runs}
    of_runs["input_steps"] = [f"{label}={step}" for label, step in STEPS.items()]
    speedup = written("compare_costs", paths["speedup"], cost_table=paths["cost_table"], **of_runs)
    fitted = written("fit_costs", tmp_path / "scaling.csv", costs=records, **of_runs, learns_from_dem="net")
    from_tables = {"speedup": paths["speedup"], "equilibrium": equilibrium}
    article = written("compare_article_costs", tmp_path / "article.csv", **from_tables)
    assert list(speedup.clock) == ["wall_s"] * 6 + ["cpu_s"] * 6
    assert list(zip(fitted.surrogate, fitted.clock, strict=True)) == [
        (label, clock) for clock in ("wall_s", "cpu_s") for label in STEPS
    ]
    assert fitted.training_s.tolist() == [500, 0, 250, 0]
    assert set(article.surrogate) == set(STEPS)
    assert set(article.slurries) == {2}
