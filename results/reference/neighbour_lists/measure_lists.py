"""Measure how fast the DEM is with each kind of neighbour lists, for narrow and for wide ranges of particle sizes.

    PATH=.venv/bin:$PATH python results/reference/neighbour_lists/measure_lists.py \
        results/reference/neighbour_lists/lists.csv

Each recipe has about 2,500 particles and is brought to a dense state; then all settings in turn continue from there, so
that other jobs on the machine slow all of them alike. Takes about five minutes.
Out: CSV of recipe, ratio of the largest to the smallest diameter, particles, whether one cutoff is that of all pairs or
each pair of sizes has its own, skin over the smallest diameter, repeat, neighbours in a list (of LAMMPS, and as
estimated from the recipe) and particle-steps per CPU second.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import pandas as pd
import yaml

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "scripts"))
from slurrycast.config.dem_checks import particles_per_pg  # noqa: E402
from slurrycast.dem import neighbour_lists  # noqa: E402
from slurrycast.dem.lammps_run import Launcher, force_field_variables, run_lammps  # noqa: E402
from slurrycast.dem.recipe import particle_types  # noqa: E402
from slurrycast.runtime.costs import children_cpu_s  # noqa: E402

PARTICLES, DENSE, STEPS, REPEATS = 2500, 8000, 1000, 3
LAUNCHER = Launcher("lmp -sf opt", "mpiexec", 1)
# Number fractions by diameter (um); the mass fractions and densities are those of config/config.yaml.
SIZES = {
    "shipped": None,
    "medium": {"BDPD": {1.8: 1.0}, "NiO": {0.6: 0.6, 1.2: 0.3, 2.1: 0.1}, "8YSZ": {0.6: 0.5, 0.9: 0.5}},
    "wide": {"BDPD": {4.0: 1.0}, "NiO": {1.7: 0.9, 5.0: 0.08, 11.0: 0.02}, "8YSZ": {1.7: 0.7, 2.5: 0.3}},
}
# whether each pair of sizes has its own cutoff, and the skin over the smallest diameter
SETTINGS = [(False, 0.3), (True, 0.3), (True, 0.15), (True, 0.6)]
COMMANDS = {
    False: "comm_modify mode single\n",  # a restart file holds another mode
    True: "neighbor ${skin_um} multi\ncomm_modify mode multi\npair_modify neigh/trim no\n",
}


def physics_of(sizes: dict | None) -> dict:
    """The physics of a slurry with these sizes; times and energies go with the smallest one."""
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    formulation, force_field, dem = (config[name] for name in ("formulation", "force_field", "dem"))
    for phase, classes in (sizes or {}).items():
        formulation["phases"][phase]["size_classes"] = [
            {"diameter_um": size, "number_fraction": share} for size, share in classes.items()
        ]
    types = particle_types(formulation["phases"])
    scale = min(t.diameter_um for t in types) / 0.5
    force_field["lennard_jones"]["epsilon_fj_per_um"] *= scale**2
    force_field["granular_hertz"]["normal_damping_per_um_us"] /= scale**2
    dem |= {"timestep_us": 1.5e-3 * scale, "pressure_damping_us": 2.0 * scale, "temperature_damping_us": 0.2 * scale}
    formulation["unit_mass_pg"] = PARTICLES / sum(particles_per_pg(types))
    row = {"mass_units": 1.0, "thickness_ratio": 1.0, "seed": 5}
    return {"formulation": formulation, "force_field": force_field, "dem": dem, "slurry": row}


def dense(folder: Path, physics: dict) -> tuple[dict, dict]:
    """Bring a slurry to a dense state in `folder`; return inputs.json and the variables of its scripts."""
    names = {"data": "initial.data", "coefficients": "coefficients.lmp", "push_off": "push_off.lmp"}
    options = {**names, "inputs": "inputs.json", "cost": "cost.json"}
    command = [sys.executable, ROOT / "scripts" / "dem" / "generate_inputs.py", "--slurry", "A"]
    command += ["--physics", json.dumps(physics)]
    command += [word for name, file in options.items() for word in (f"--{name.replace('_', '-')}", folder / file)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    inputs = json.loads((folder / "inputs.json").read_text(encoding="utf-8"))
    variables = {
        **force_field_variables(physics),
        **names,
        "push_off_iterations": 1000,
        "velocity_seed": 1,
        "thermo_every_steps": STEPS,
        "frame_every_steps": DENSE,
    }
    for script in ("push_off", "start", "slurry"):
        run_lammps(LAUNCHER, f"{script}.lmp", {**variables, "from": 0, "to": DENSE}, folder, f"{script}.log")
    return inputs, variables


def measured(folder: Path, variables: dict, own: bool, skin_um: float) -> tuple[float, float]:
    """CPU seconds of STEPS steps behind DENSE, and LAMMPS' mean number of neighbours in a list."""
    text = (folder / "coefficients.lmp").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line.startswith(("#", "pair_coeff"))]
    (folder / "tried.lmp").write_text(COMMANDS[own] + "\n".join(lines) + "\n", encoding="utf-8")
    ends = {"coefficients": "tried.lmp", "skin_um": skin_um, "from": DENSE, "to": DENSE + STEPS}
    before_s = children_cpu_s()
    run_lammps(LAUNCHER, "slurry.lmp", variables | ends, folder, "tried.log")
    spent_s = children_cpu_s() - before_s
    log = (folder / "tried.log").read_text(encoding="utf-8")
    return spent_s, float(log.partition("Ave neighs/atom = ")[2].split()[0])


def main() -> None:
    """Measure all and write the table."""
    rows = []
    with tempfile.TemporaryDirectory() as place:
        for recipe, sizes in SIZES.items():
            folder = Path(place, recipe)
            folder.mkdir()
            inputs, variables = dense(folder, physics := physics_of(sizes))
            types = particle_types(physics["formulation"]["phases"])
            counts = [t["particles"] for t in inputs["types"]]
            smallest_um, largest_um = (choose(t.diameter_um for t in types) for choose in (min, max))
            for repeat in range(REPEATS):
                for own, skin in SETTINGS:
                    cpu_s, found = measured(folder, variables, own, skin * smallest_um)
                    estimate = neighbour_lists.neighbours(types, counts, 1.5, skin * smallest_um, own)
                    rows.append(
                        {
                            "recipe": recipe,
                            "size_ratio": largest_um / smallest_um,
                            "particles": inputs["particles"],
                            "own_cutoffs": own,
                            "skin_share": skin,
                            "repeat": repeat,
                            "neighbours": found,
                            "neighbours_estimated": estimate,
                            "particle_steps_per_cpu_s": inputs["particles"] * STEPS / cpu_s,
                        }
                    )
                    print(rows[-1], flush=True)
    pd.DataFrame(rows).to_csv(sys.argv[1], index=False, float_format="%.4g")


if __name__ == "__main__":
    main()
