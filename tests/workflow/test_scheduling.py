"""Snakemake waits for jobs without using the processor."""

from checkouts import snakemake
from configurations import ROOT

SLURRIES = ("T1", "T2", "T3", "1", "2", "V1", "N1")


def test_only_a_job_that_ends_makes_snakemake_look_for_further_ones(tmp_path):
    config = ROOT / "config" / "tiny.yaml"
    options = ["--directory", str(tmp_path), "--configfile", str(config), "--verbose", "--cores", "1"]
    said = snakemake(ROOT, *options, "--", *(f"results/tiny/dem/{slurry}/inputs.json" for slurry in SLURRIES))
    assert 0 < said.count("\nReady jobs: ") <= len(SLURRIES)
