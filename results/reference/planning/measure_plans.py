"""Measure how long Snakemake plans an exploration of many recipes.

    .venv/bin/python results/reference/planning/measure_plans.py results/reference/planning/plans.csv

Each is config/explore.yaml with another number of points, whose design is written before. Takes some minutes.
Out: CSV of points, jobs, repeat, and the CPU and wall seconds of a dry-run, with the start of Snakemake.
"""

import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).resolve().parents[3]
POINTS, REPEATS = (64, 250, 1000), 3


def snakemake(folder: Path, target: str, *arguments: str) -> str:
    """Run Snakemake for a target in `folder`; return what it prints."""
    files = [ROOT / "config" / "explore.yaml", folder / "points.yaml"]
    command = [Path(sys.executable).with_name("snakemake"), target, "--snakefile", ROOT / "Snakefile"]
    command += ["--directory", folder, "--cores", "1", *arguments, "--configfile", *files]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def cpu_s() -> float:
    """CPU seconds of all programs that have ended."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def main() -> None:
    """Measure and write."""
    rows = []
    for points in POINTS:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "points.yaml").write_text(f"explore: {{points: {points}}}\n")
            snakemake(folder, "design")
            for repeat in range(1, REPEATS + 1):
                wall, cpu = time.perf_counter(), cpu_s()
                plan = snakemake(folder, "explore", "--dry-run", "--quiet", "rules")
                wall, cpu = time.perf_counter() - wall, cpu_s() - cpu
                jobs = int(re.search(r"^total +(\d+)", plan, re.MULTILINE)[1])
                rows.append({"points": points, "jobs": jobs, "repeat": repeat, "cpu_s": cpu, "wall_s": wall})
                print(rows[-1], flush=True)
    pd.DataFrame(rows).round(2).to_csv(sys.argv[1], index=False)


if __name__ == "__main__":
    main()
