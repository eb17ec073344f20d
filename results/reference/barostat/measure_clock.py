"""Measure how long a box takes to shrink to 0.75 of its edge, with each barostat, for few and for many particles.

    PATH=.venv/bin:$PATH python results/reference/barostat/measure_clock.py results/reference/barostat/clock.csv

Slurries of config/config.yaml with 1 and 5 units of mass. `npt, pchain 0` is LAMMPS' NPT without the chain of
thermostats that its barostat has by default. Takes about a minute.
Out: CSV of barostat, particles, shrink_time_us.
"""

import json
import sys
import tempfile
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT / "results" / "reference" / "mpi")]
from measure_ranks import MASS_UNITS, ONE, generate  # noqa: E402

from slurrycast.dem.lammps_run import run_lammps  # noqa: E402
from slurrycast.evaluation.size import shrink_time_us  # noqa: E402

# What stands for ${barostat} and ${pressure_damping_us} in slurry.lmp.
BAROSTATS = {"npt": ("npt", "2.0e4"), "npt, pchain 0": ("npt", "2.0e4 pchain 0"), "berendsen": ("berendsen", "14.0")}
STEPS = 10000  # 20 us


def main() -> None:
    """Measure all and write the table."""
    rows = []
    for mass_units in MASS_UNITS:
        for name, (barostat, damping) in BAROSTATS.items():
            with tempfile.TemporaryDirectory() as folder:
                particles, variables = generate(Path(folder), mass_units)
                variables |= {"barostat": barostat, "pressure_damping_us": damping, "thermo_every_steps": 20}
                for script in ("push_off", "start", "slurry"):
                    ends = {"from": 0, "to": STEPS}
                    log = run_lammps(ONE, f"{script}.lmp", variables | ends, Path(folder), f"{script}.log")
            time_us, edge_um = (log.thermo[:, log.columns.index(column)] for column in ("v_time_us", "Lx"))
            rows.append({"barostat": name, "particles": particles, "shrink_time_us": shrink_time_us(time_us, edge_um)})
            print(json.dumps(rows[-1]), flush=True)
    pd.DataFrame(rows).to_csv(sys.argv[1], index=False, float_format="%.3f")


if __name__ == "__main__":
    main()
