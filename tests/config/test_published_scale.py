"""The published size: what jobs ask for, against measurements of the reference runs, and how far the RDF reaches."""

import re

import numpy as np
import pandas as pd
import pytest

from checkouts import copy_checkout, snakemake
from configurations import ROOT, read_slurries, shipped
from reference_results import REFERENCE, measured_rates, published_estimates, read_result
from slurrycast.analysis.rdf import bin_edges_um
from slurrycast.config.dem_checks import shortest_edges

WILDCARDS = {
    "`run_slurry`, slurry 2": "slurry=2",
    "`run_slurry`, slurry 6": "slurry=6",
    "`relax_slurry`, slurry 6": "surrogate=vgg16, slurry=6, steps=",
    "`train_surrogate`, `vgg16`": "surrogate=vgg16",
}


@pytest.mark.parametrize("scale", ["published", "published_dt1e-4"])
def test_the_rdf_of_each_slurry_reaches_as_far_as_in_the_article(scale):
    config = shipped(scale)
    analysis = config["analysis"]
    for edge_um, slurry in shortest_edges(config, read_slurries(ROOT / config["slurries"])):
        reached_um = bin_edges_um(analysis["rdf_cutoff_um"], analysis["rdf_bins"], [np.array([edge_um])])
        assert (len(reached_um) - 1, reached_um[-1]) == (120, pytest.approx(7.0)), slurry


def test_both_configurations_differ_in_what_goes_with_the_time_step_alone():
    quick, slow = shipped("published"), shipped("published_dt1e-4")
    of_the_step = {
        "run": {"name"},
        "dem": {"timestep_us", "steps", "thermo_every_steps", "barostat", "pressure_damping_us", "max_rayleigh_share"},
        "relaxation": {"steps", "pressure_damping_steps"},
        "drying": {"steps_per_stage", "rest_steps", "timestep_factor"},
        "convergence": {"timesteps_us"},
    }
    for key in (quick.keys() | slow.keys()) - {"surrogate"}:
        if quick[key] != slow[key]:
            assert {name for name in quick[key] if quick[key][name] != slow[key][name]} <= of_the_step[key], key
    ours, theirs = quick["surrogate"], slow["surrogate"]
    assert ours["names"] == theirs["names"] and ours["vgg16"]["batch_size"] == theirs["vgg16"]["batch_size"]


@pytest.mark.parametrize("scale", ["published", "published_dt1e-4"])
def test_jobs_ask_for_enough_time_and_memory(tmp_path, scale):
    """On cores less than half as fast, where a job has one; a training has several."""
    plan = snakemake(copy_checkout(tmp_path / "published"), "--dry-run", "--configfile", f"config/{scale}.yaml")
    blocks = re.split(r"\n(?=rule |localrule )", plan)
    cpu_h = published_estimates(scale).set_index("job").cpu_h
    for job, wildcards in WILDCARDS.items():
        rule = job.split("`")[1]
        (block,) = (
            block for block in blocks if block.startswith(f"rule {rule}:") and f"wildcards: {wildcards}\n" in block
        )
        runtime_min, mem_mb = (int(re.search(rf"\b{name}=(\d+)", block)[1]) for name in ("runtime", "mem_mb"))
        threads = int(found[1]) if (found := re.search(r"threads: (\d+)", block)) else 1
        assert runtime_min / 60 * threads > 2 * cpu_h[job], job
        assert mem_mb > 2 * measured_rates()["memory_mb"], job


def test_memory_of_a_dem_grows_more_slowly_than_the_rules_ask():
    cost = read_result("published", "cost")
    runs = cost[cost.stage == "run_slurry"]
    span_mb, span = (np.ptp(runs[name]) for name in ("max_rss_mb", "particles"))
    assert span_mb / span < 1 / 20  # MB per particle, as in slurry_mb


def test_side_by_side_is_faster_than_two_ranks():
    times = pd.read_csv(REFERENCE / "mpi" / "ranks.csv").groupby("particles").median()
    assert (2 * times.two_ranks_s > times.side_by_side_s).all()
    for scale in (ROOT / "config").glob("*.yaml"):
        config = shipped(scale.stem)
        alone = len(read_slurries(ROOT / config["slurries"])) == 1  # nothing to run beside it
        assert alone or config["dem"]["ranks"] == 1, scale
