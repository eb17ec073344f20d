"""Measure what pictures, figures, structures and pages of a run take: stages that keep no record of their cost.

    .venv/bin/snakemake --cores 2 all evaluation --configfile config/published.yaml
    PATH=.venv/bin:$PATH python results/reference/pages/measure_pages.py results/reference/pages/pages.csv \
        config/published.yaml

In: the configuration files of a run that is done. The files are made again, in some minutes.
Out: CSV of one row a file: stage, file, cpu_s and max_rss_mb of its command, and its size_mb.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import yaml

FILES = (
    "figures/slurry_vgg16_6.png",
    "figures/coordinates_6.png",
    "figures/rdf.png",
    "structure/vgg16/6.csv",
    "structure/dem/6.csv",
    "tables/noise.csv",
    "tables/verdicts.csv",
    "report.html",
    "evaluation.html",
)


def command(file: str, configurations: list[str]) -> str:
    """Shell command that makes one file, as Snakemake prints it."""
    plan = ["snakemake", "--dry-run", "--cores", "1", "--force", file, "--configfile", *configurations]
    printed = subprocess.run(plan, check=True, text=True, capture_output=True)
    return re.findall(r"Shell command: (.*)", printed.stdout + printed.stderr)[-1]


def main() -> None:
    """Measure all and write the table."""
    table, *configurations = sys.argv[1:]
    merged = [yaml.safe_load(Path(path).read_text(encoding="utf-8")) for path in configurations]
    name = [part["run"]["name"] for part in merged if "run" in part][-1]
    rows = []
    for file in FILES:
        path = Path("results", name, file)
        call = command(str(path), configurations)
        process = subprocess.Popen(["bash", "-c", f"set -euo pipefail; {call}"])
        _, status, used = os.wait4(process.pid, 0)
        if status:
            sys.exit(f"{call}\nfailed")
        row = {
            "stage": Path(call.split()[1]).stem,
            "file": file,
            "cpu_s": used.ru_utime + used.ru_stime,
            "max_rss_mb": used.ru_maxrss / 1024,
            "size_mb": path.stat().st_size / 1e6,
        }
        rows.append(row)
        print(row, flush=True)
    pd.DataFrame(rows).to_csv(table, index=False, float_format="%.4g")


if __name__ == "__main__":
    main()
