"""Measure what `direct` spends its CPU time on, from the recipe to the relaxed slurry.

    PATH=.venv/bin:$PATH python results/reference/relaxation/profile_relaxation.py profile.csv

Slurry 6 of config/reduced.yaml, through the scripts of the workflow. The start of Python and its imports is that of
each script with --help. LAMMPS gives its sections in wall time, of which each takes its share of the CPU time of the
steps. Other jobs on the machine change CPU times far less than wall times. Takes half a minute.
Out: CSV of part, cpu_s, and share of all.
"""

import json
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pandas as pd
import yaml

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT / "scripts" / "dem")]
from measure_relaxations import LAST_INPUT, TARGET, call, predict_slurry, relax_slurry, wrap_slurry  # noqa: E402

import generate_inputs  # noqa: E402
from slurrycast.dem.lammps_run import run_lammps  # noqa: E402
from slurrycast.runtime.costs import children_cpu_s  # noqa: E402

SLURRY = {"mass_units": 5.0, "thickness_ratio": 2.0, "seed": 2006}
LOOP = re.compile(r"^Loop time of (\S+) on .*?^(\S+)% CPU use.*?^-+$(.*?)^$", re.MULTILINE | re.DOTALL)
SECTION = re.compile(r"^(\w+) +\|[^|]*\| *([^ |]+) *\|", re.MULTILINE)  # the average over the ranks


def cpu_s() -> float:
    """CPU seconds of this process and its children so far."""
    return time.process_time() + children_cpu_s()


def sections(log: str) -> dict[str, float]:
    """CPU seconds of LAMMPS by the sections of its log, over all of its runs."""
    total: dict[str, float] = {}
    for _, use_percent, table in LOOP.findall(log):
        for name, wall_s in SECTION.findall(table):
            total[name] = total.get(name, 0.0) + float(wall_s) * float(use_percent) / 100
    return total


def profile(folder: Path) -> dict[str, float]:
    """CPU seconds by part."""
    base, reduced = (
        yaml.safe_load((ROOT / "config" / f"{name}.yaml").read_text(encoding="utf-8")) for name in ("config", "reduced")
    )
    physics = {
        "formulation": base["formulation"] | reduced["formulation"],
        "force_field": base["force_field"],
        "dem": base["dem"],
        "slurry": SLURRY,
    }
    inputs, predicted = {"inputs": folder / "inputs.json"}, {"predicted": folder / "predicted.h5"}
    wrapped = {"wrapped": folder / "wrapped.data"}
    lines = {"coefficients": folder / "coefficients.lmp", "push_off": folder / "push_off.lmp"}
    surrogate = {"surrogate": "direct", "settings": json.dumps(base["surrogate"]["direct"])}
    surrogate |= {"input_frames": LAST_INPUT, "target_frame": TARGET}  # which it does not look at
    generated = {"slurry": "6", "physics": json.dumps(physics), "data": folder / "initial.data"}
    relaxed = {"settings": json.dumps(base["relaxation"]), "executable": base["dem"]["executable"]}
    relaxed |= {"relaxed_data": folder / "relaxed.data", "relaxed": folder / "relaxed.h5", "work": folder / "work"}
    jobs = {
        generate_inputs: generated | lines | inputs,
        predict_slurry: surrogate | inputs | predicted,
        wrap_slurry: inputs | predicted | wrapped,
        relax_slurry: relaxed | inputs | predicted | wrapped | lines,
    }
    lammps_s, logs = {}, {}

    def recorded(launcher: object, script: str, variables: dict, work: Path, log: str, *progress: object) -> object:
        """`run_lammps`, whose CPU time and log are kept."""
        before = children_cpu_s()
        result = run_lammps(launcher, script, variables, work, log, *progress)
        lammps_s[script], logs[script] = children_cpu_s() - before, (work / log).read_text(encoding="utf-8")
        return result

    relax_slurry.run_lammps = recorded
    start_s, work_s = {}, {}
    for script, options in jobs.items():
        before = cpu_s()
        subprocess.run([sys.executable, script.__file__, "--help"], check=True, capture_output=True)
        started = cpu_s()
        call(script, cost=folder / "cost.json", **options)
        start_s[script.__name__], work_s[script.__name__] = started - before, cpu_s() - started
    work_s["relax_slurry"] -= sum(lammps_s.values())
    by_section = sections(logs["relax.lmp"])
    return {
        **{f"start of Python, {name}": seconds for name, seconds in start_s.items()},
        **{f"work of the scripts, {name}": seconds for name, seconds in work_s.items()},
        "LAMMPS, push-off": lammps_s["push_off.lmp"],
        "LAMMPS, start and end of the relaxation": lammps_s["relax.lmp"] - sum(by_section.values()),
        **{f"LAMMPS, {name}": seconds for name, seconds in by_section.items()},
    }


def main() -> None:
    """Measure and write the table."""
    with tempfile.TemporaryDirectory() as folder:
        seconds = profile(Path(folder))
    table = pd.DataFrame(seconds.items(), columns=["part", "cpu_s"])
    table.assign(share=table.cpu_s / table.cpu_s.sum()).to_csv(sys.argv[1], index=False, float_format="%.4g")


if __name__ == "__main__":
    main()
