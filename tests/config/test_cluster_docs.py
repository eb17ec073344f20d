"""What docs/cluster.md says of cost and of MPI ranks, against the reference runs and what the full scale asks for."""

import re
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
import yaml

from checkouts import copy_checkout, snakemake
from configurations import ROOT
from slurrycast.config.configuration import read_slurries
from slurrycast.data.tables import read_table
from slurrycast.dem.recipe import particle_counts, particle_types


@pytest.fixture(scope="module")
def text() -> str:
    return (ROOT / "docs" / "cluster.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def asked(tmp_path_factory) -> Callable[[str, str], tuple[int, int]]:
    """Walltime in minutes and memory in MB that a job of the full scale asks for, by its rule and wildcards."""
    project = copy_checkout(tmp_path_factory.mktemp("full"))
    plan = snakemake(project, "--dry-run", "--configfile", "config/full.yaml")

    def look_up(rule: str, wildcards: str) -> tuple[int, int]:
        block = next(
            block
            for block in re.split(r"\n(?=rule |localrule )", plan)
            if block.startswith(f"rule {rule}:") and f"wildcards: {wildcards}\n" in block
        )
        return tuple(int(re.search(rf"\b{name}=(\d+)", block)[1]) for name in ("runtime", "mem_mb"))

    return look_up


def rates(reference: Path) -> tuple[float, float, float]:
    """Particle-steps a CPU second of DEM and relaxation, and CPU seconds of training a particle and epoch."""
    cost = read_table(reference / "tables" / "cost.csv")
    particles = cost[cost.stage == "run_slurry"].set_index("slurry").particles
    whole = cost[(cost.stage == "run_slurry") & (cost.steps == cost.steps.max())]
    relaxed = cost[cost.stage == "relax_slurry"]
    training = cost[(cost.stage == "train_surrogate") & (cost.surrogate == "vgg16")].iloc[0]
    epochs = len(pd.read_csv(reference / "models" / "vgg16" / "history.csv"))
    return (
        (whole.particles * whole.steps / whole.cpu_s).median(),
        (relaxed.slurry.map(particles) * relaxed.steps / relaxed.cpu_s).median(),
        training.cpu_s / (training.particles * epochs),
    )


def test_cost_of_the_full_scale(root, text, asked):
    dem_rate, relaxation_rate, training_s = rates(root / "results" / "reference" / "reduced")
    assert f"{dem_rate:.1e}".replace("e+06", "e6") + " particle-steps of the DEM" in text
    assert f"{relaxation_rate:.1e}".replace("e+06", "e6") + " of the relaxation" in re.sub(r"\s+", " ", text)
    assert f"{1e3 * training_s:.2f} ms of training" in text

    config = yaml.safe_load((root / "config" / "config.yaml").read_text())
    full = yaml.safe_load((root / "config" / "full.yaml").read_text())
    types = particle_types(config["formulation"]["phases"])
    slurries = read_slurries(root / config["slurries"])
    unit_mass_pg = full["formulation"]["unit_mass_pg"]
    particles = {run.id: int(particle_counts(types, run.mass_units * unit_mass_pg).sum()) for run in slurries}
    steps, relaxation, epochs = full["dem"]["steps"], full["relaxation"]["steps"], full["surrogate"]["vgg16"]["epochs"]
    trained = sum(particles[run.id] for run in slurries if run.role == "train")
    complete = sum(particles[run.id] for run in slurries if run.role != "new")

    def row(name: str, count: int, of: int, hours: float, job: tuple[int, int] | None) -> str:
        limits = f"{job[0] / 60:.1f} | {job[1]:,}" if job else "- | -"
        return f"| {name} | {count:,} | {of:,} | {hours:.1f} | {limits} |"

    def dem_hours(count: int) -> float:
        return count * steps / dem_rate / 3600

    expected = [
        row(
            f"`run_slurry`, slurry {id}",
            particles[id],
            steps,
            dem_hours(particles[id]),
            asked("run_slurry", f"slurry={id}"),
        )
        for id in ("2", "6")
    ]
    expected += [
        row("`run_slurry`, all 17 that run to the end", complete, steps, dem_hours(complete), None),
        row(
            "`relax_slurry`, slurry 6",
            particles["6"],
            relaxation,
            particles["6"] * relaxation / relaxation_rate / 3600,
            asked("relax_slurry", "surrogate=vgg16, slurry=6, steps="),
        ),
        row(
            "`train_surrogate`, `vgg16`",
            trained,
            epochs,
            training_s * trained * epochs / 3600,
            asked("train_surrogate", "surrogate=vgg16"),
        ),
    ]
    assert len([run for run in slurries if run.role != "new"]) == 17
    shown = [line for line in text.splitlines() if line.startswith("| `")]
    assert shown == expected


def test_a_smaller_time_step_costs_less_a_step(root, text):
    """The rate is that of the coarse step; the full scale takes the fine one."""
    summary = pd.read_csv(root / "results" / "reference" / "timestep" / "timestep_summary.csv").set_index("timestep_us")
    saved = 1 - (summary.cpu_s_mean[1e-4] / summary.cpu_s_mean[2e-3]) / (2e-3 / 1e-4)
    assert f"{saved:.0%} less CPU time a step" in re.sub(r"\s+", " ", text)


def test_memory(root, text):
    cost = read_table(root / "results" / "reference" / "reduced" / "tables" / "cost.csv")
    peak_mb = cost[cost.stage == "run_slurry"].set_index("slurry")[["particles", "max_rss_mb"]]
    said = (
        f"{peak_mb.max_rss_mb.max():.0f} MB with {peak_mb.particles.min():,.0f} as with {peak_mb.particles.max():,.0f}"
    )
    assert peak_mb.max_rss_mb.max() - peak_mb.max_rss_mb.min() < 1
    assert said in re.sub(r"\s+", " ", text)


def test_side_by_side_is_faster_than_two_ranks(root, text):
    times = pd.read_csv(root / "results" / "reference" / "mpi" / "ranks.csv").groupby("particles")
    times = times[["side_by_side_s", "two_ranks_s"]].median()
    one_after_the_other_s = 2 * times.two_ranks_s
    assert (one_after_the_other_s > times.side_by_side_s).all()
    for particles, row in times.iterrows():
        both_s = 2 * row.two_ranks_s
        line = f"| {particles:,} | {row.side_by_side_s:.2f} | {both_s:.2f} | {both_s / row.side_by_side_s:.2f} |"
        assert line in text.splitlines()
    for scale in (root / "config").glob("*.yaml"):
        ranks = (yaml.safe_load(scale.read_text()).get("dem") or {}).get("ranks", 1)
        assert ranks == 1, scale
