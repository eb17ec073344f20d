"""Measure how long `snakemake --cores 2 microstructures --configfile config/recipe.yaml` takes, from start to end.

    .venv/bin/python results/reference/recipe/measure_recipe.py results/reference/recipe/cost.csv

Nothing else should run meanwhile. Takes about a minute.
Out: CSV of stage, particles, wall_s and cpu_s; `snakemake` is the whole command, its own process in it.
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

STAGES = ("generate_inputs", "predict_slurry", "wrap_slurry", "relax_slurry")


def main() -> None:
    """Run the command in an empty folder and write the table."""
    program = Path(sys.executable).with_name("snakemake")
    command = [program, "--snakefile", ROOT / "Snakefile", "--cores", "2", "microstructures"]
    with tempfile.TemporaryDirectory() as folder:
        start = time.monotonic()
        options = ["--directory", folder, "--configfile", ROOT / "config" / "recipe.yaml"]
        subprocess.run([*command, *options], check=True)
        wall_s, spent = time.monotonic() - start, os.times()
        results = Path(folder) / "results" / "recipe"
        records = [read_cost(path) for stage in STAGES for path in results.glob(f"costs/{stage}/**/*.json")]
        (relaxed,) = results.glob("hybrid/direct/*/relaxed.h5")
        with read_frames(relaxed) as store:
            print(f"{store.density_g_cm3(store.last):.4f} g/cm3, kinetic share {store.attributes['kinetic_share']:.2g}")
    rows = [(cost.stage, cost.particles, cost.wall_s, cost.cpu_s) for cost in records]
    rows.append(("snakemake", records[0].particles, wall_s, spent.children_user + spent.children_system))
    table = pd.DataFrame(rows, columns=["stage", "particles", "wall_s", "cpu_s"])
    table.to_csv(sys.argv[1], index=False, float_format="%.2f")


if __name__ == "__main__":
    main()
