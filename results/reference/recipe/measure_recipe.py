"""Measure how long `snakemake --cores 2 microstructures --configfile config/recipe.yaml` takes, and `tapes` after it.

    .venv/bin/python results/reference/recipe/measure_recipe.py results/reference/recipe/cost.csv

Nothing else should run meanwhile. Takes a minute for the slurry and some ten for its tape.
Out: CSV of stage, particles, wall_s and cpu_s; `snakemake` and `snakemake tapes` are the whole commands, their own
process in them. `tapes` also dries at both ends of friction (`calibrate_drying`), and draws.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "scripts"))
from slurrycast.data.frames import read_frames  # noqa: E402
from slurrycast.runtime.costs import read_cost  # noqa: E402

# By the target that runs them, in the order of the rows; the measures are of slurry and tape.
COSTS = {
    "microstructures": ["generate_inputs/*", "predict_slurry/*/*", "wrap_slurry/*/*", "relax_slurry/*/*"],
    "tapes": [
        "dry_slurry/*/*",
        "measure_microstructure/*/*_slurry",
        "measure_microstructure/*/*_tape",
        "calibrate_drying",
    ],
}


def children_s() -> float:
    """CPU seconds of all processes that were started and have ended."""
    spent = os.times()
    return spent.children_user + spent.children_system


def main() -> None:
    """Run both commands in one empty folder and write the table."""
    program = Path(sys.executable).with_name("snakemake")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "results" / "recipe"
        options = ["--directory", folder, "--configfile", ROOT / "config" / "recipe.yaml"]
        for target, costs in COSTS.items():
            start_s, before_s = time.monotonic(), children_s()
            subprocess.run([program, "--snakefile", ROOT / "Snakefile", "--cores", "2", target, *options], check=True)
            wall_s, cpu_s = time.monotonic() - start_s, children_s() - before_s
            for pattern in costs:
                (path,) = results.glob(f"costs/{pattern}.json")
                cost, what = read_cost(path), pattern.partition("*_")[2]
                rows.append((f"{cost.stage} {what}".strip(), cost.particles, cost.wall_s, cost.cpu_s))
            whole = "snakemake" if target == "microstructures" else f"snakemake {target}"
            rows.append((whole, rows[0][1], wall_s, cpu_s))
        (relaxed,) = results.glob("hybrid/direct/*/relaxed.h5")
        with read_frames(relaxed) as store:
            print(f"{store.density_g_cm3(store.last):.4f} g/cm3, kinetic share {store.attributes['kinetic_share']:.2g}")
    table = pd.DataFrame(rows, columns=["stage", "particles", "wall_s", "cpu_s"])
    table.to_csv(sys.argv[1], index=False, float_format="%.2f")


if __name__ == "__main__":
    main()
