"""DEM runs that follow from rows of the slurry table, and their settings."""

import pytest

from configurations import ROOT, read_slurries
from slurrycast.config.derived_runs import dried_replicas, replicas, timestep_runs
from slurrycast.config.physics import physics
from slurrycast.config.slurry_table import Slurry


@pytest.fixture
def slurries() -> list[Slurry]:
    return read_slurries(ROOT / "config" / "slurries.tsv")


def test_replicas_differ_from_their_slurry_in_id_role_and_seed_alone(config, slurries):
    runs = replicas(config, slurries)
    assert [run.id for run in runs] == [f"{slurry}_r{k}" for slurry in "26" for k in range(1, 6)]
    assert {run.role for run in runs} == {"replica"}
    assert len({run.seed for run in [*runs, *slurries]}) == len(runs) + len(slurries)
    original = physics(config, next(slurry for slurry in slurries if slurry.id == "6"))
    assert physics(config, runs[-1]) == original | {"slurry": original["slurry"] | {"seed": runs[-1].seed}}


@pytest.mark.parametrize(
    ("replicated", "sources", "number", "ids"),
    [
        (["2", "6"], ["dem"], 3, ["2_r1", "2_r2", "2_r3"]),  # some of those of the evaluation
        (["6", "7", "V1"], ["direct", "dem"], 2, ["7_r1", "7_r2"]),  # the smallest test slurry of these
        (["V1"], ["dem"], 6, [f"2_r{k}" for k in range(1, 7)]),
        ([], ["dem"], 2, ["2_r1", "2_r2"]),
        (["2"], ["dem"], 0, []),
        (["2"], ["direct"], 3, []),
    ],
)
def test_replicas_of_one_small_test_slurry_are_dried(config, slurries, replicated, sources, number, ids):
    config["evaluation"] |= {"replicated": replicated}
    config["drying"] |= {"sources": sources, "replicas": number}
    runs = dried_replicas(config, slurries)
    assert [run.id for run in runs] == ids
    every = {run.id: run for run in replicas(config, slurries)}
    assert len(every) == len({run.seed for run in every.values()}) == len({*ids, *every})
    assert [every[run.id] for run in runs] == runs
    assert dried_replicas(config, [slurry for slurry in slurries if slurry.role != "test"]) == []


def test_the_smallest_slurry_is_the_lightest(config):
    config["formulations"] = {"big": {"unit_mass_pg": 9142.0}}
    config["evaluation"]["replicated"] = []
    config["drying"] |= {"sources": ["dem"], "replicas": 2}
    two = [Slurry("A", "test", 2, 1.2, 1), Slurry("B", "test", 1, 1.2, 2, formulation="big")]
    assert [run.id for run in dried_replicas(config, two)] == ["A_r1", "A_r2"]


def test_timestep_runs_end_at_the_same_time_with_the_same_frames(config, slurries):
    runs = timestep_runs(config, slurries)
    assert [run.id for run in runs[::3]] == ["V1_dt100ps_s1", "V1_dt500ps_s1", "V1_dt1000ps_s1", "V1_dt2000ps_s1"]
    assert len({run.seed for run in runs}) == config["convergence"]["seeds"]
    for run in runs:
        dem = physics(config, run)["dem"]
        assert dem["steps"] * dem["timestep_us"] == pytest.approx(config["dem"]["steps"] * config["dem"]["timestep_us"])
        assert dem["thermo_every_steps"] * dem["timestep_us"] == pytest.approx(0.8)
        assert dem["frames"] == config["dem"]["frames"]
        assert dem["steps"] % (dem["frames"] - 1) == 0
