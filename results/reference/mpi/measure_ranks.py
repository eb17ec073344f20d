"""Measure which is faster on two cores: two slurries side by side on a rank each, or one after the other on two ranks.

    PATH=.venv/bin:$PATH python results/reference/mpi/measure_ranks.py results/reference/mpi/ranks.csv

Each slurry is of config/config.yaml with a mass of its own, brought to step 10000 (20 us, dense) and then run for one
segment of 3000 steps as in the workflow, both ways in turn. Takes about two minutes on two cores that do nothing else.
Out: CSV of particles, steps, repeat, and the wall seconds of two slurries side by side, and of one slurry on two ranks.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pandas as pd
import yaml

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "scripts"))
from slurrycast.dem.lammps_run import Launcher, force_field_variables, run_lammps  # noqa: E402

MASS_UNITS = (1.0, 5.0)  # about 600 and 3 000 particles, the smallest and the largest of the demo
DENSE, STEPS, REPEATS = 10000, 3000, 5  # a segment of the demo
ONE, TWO = Launcher("lmp", "mpiexec", 1), Launcher("lmp", "mpiexec", 2)


def generate(folder: Path, mass_units: float) -> tuple[int, dict]:
    """Write the inputs of a slurry to `folder`; return its particles and the variables of its LAMMPS scripts."""
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    physics = {
        "formulation": config["formulation"],
        "force_field": config["force_field"],
        "dem": config["dem"],
        "slurry": {"mass_units": mass_units, "thickness_ratio": 2.0, "seed": 2006},
    }
    files = {"data": "initial.data", "coefficients": "coefficients.lmp", "push_off": "push_off.lmp"}
    options = {**files, "inputs": "inputs.json", "cost": "cost.json"}
    command = [
        sys.executable,
        ROOT / "scripts" / "dem" / "generate_inputs.py",
        "--slurry",
        "A",
        "--physics",
        json.dumps(physics),
    ]
    command += [word for name, file in options.items() for word in (f"--{name.replace('_', '-')}", folder / file)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    inputs = json.loads((folder / "inputs.json").read_text(encoding="utf-8"))
    variables = {
        **force_field_variables(inputs["physics"]),
        **files,
        "push_off_iterations": config["dem"]["push_off_iterations"],
        "velocity_seed": inputs["seeds"]["velocities"],
        "thermo_every_steps": config["dem"]["thermo_every_steps"],
        "frame_every_steps": config["dem"]["steps"] // (config["dem"]["frames"] - 1),
    }
    return inputs["particles"], variables


def prepared(folder: Path, mass_units: float) -> tuple[int, dict]:
    """Run a slurry to DENSE in `folder`; return its particles and the variables of its segments."""
    particles, variables = generate(folder, mass_units)
    for script in ("push_off", "start", "slurry"):
        run_lammps(ONE, f"{script}.lmp", {**variables, "from": 0, "to": DENSE}, folder, f"{script}.log")
    return particles, variables


def wall_s(folders: list[Path], launcher: Launcher, variables: dict) -> float:
    """Seconds until the segment behind DENSE has ended in all folders, which run at once."""
    ends = {**variables, "from": DENSE, "to": DENSE + STEPS}
    start = time.perf_counter()
    with ThreadPoolExecutor() as pool:
        list(pool.map(lambda folder: run_lammps(launcher, "slurry.lmp", ends, folder, "segment.log"), folders))
    return time.perf_counter() - start


def main() -> None:
    """Measure all sizes and write the table."""
    rows = []
    for mass_units in MASS_UNITS:
        with tempfile.TemporaryDirectory() as first, tempfile.TemporaryDirectory() as second:
            folders = [Path(first), Path(second)]
            for folder in folders:
                particles, variables = prepared(folder, mass_units)
            for repeat in range(REPEATS):
                times = {
                    "side_by_side_s": wall_s(folders, ONE, variables),
                    "two_ranks_s": wall_s(folders[:1], TWO, variables),
                }
                rows.append({"particles": particles, "steps": STEPS, "repeat": repeat, **times})
                print(rows[-1], f"load {os.getloadavg()[0]:.1f}", flush=True)
    pd.DataFrame(rows).to_csv(sys.argv[1], index=False, float_format="%.3f")


if __name__ == "__main__":
    main()
