"""Forces of pairs of phases, and wide ranges of sizes, in LAMMPS: closed forms for two particles, and restarts."""

import json
import shutil
from itertools import combinations_with_replacement, pairwise
from pathlib import Path

import numpy as np
import pytest

from configurations import load
from formulations import phase
from slurrycast.data.frames import read_frames, write_frames
from slurrycast.dem import forcefield, lammps_run, neighbour_lists
from slurrycast.dem.drying import dry_force_field, drying_types
from slurrycast.dem.drying_run import dry
from slurrycast.dem.lammps_data import write_data
from slurrycast.dem.lammps_dump import as_frame, read_dump
from slurrycast.dem.lammps_run import Launcher, force_field_variables, run_lammps
from slurrycast.dem.particles import particles_of
from slurrycast.dem.recipe import particle_types

CONFIG = load("config")
LAUNCHER = Launcher("lmp -sf opt", "mpiexec", 1)
SCRIPTS = {path.name: path.read_text() for path in lammps_run.SCRIPTS.glob("*.lmp")}
PHASES = {
    "soft": phase(0.1, 0.8, {1.1: 1.0}),
    "hard": phase(0.5, 6.0, {0.6: 0.5, 0.9: 0.5}),
    "other": phase(0.4, 6.0, {0.5: 1.0}),
}
PAIRS = {
    "soft-soft": {"friction": 0.1, "normal_stiffness_kpa": 1.0e5, "epsilon_fj_per_um": 2.0},
    "other-hard": {"friction": 0.5, "tangential_damping_ratio": 1.0},
    "hard-hard": {"friction": 0.5, "normal_damping_per_um_us": 10.0, "tangential_stiffness_ratio": 1.0},
}
FORCE_FIELD = CONFIG["force_field"] | {"pairs": PAIRS}
OVERLAP_UM, SLOW_UM_US, FAST_UM_US = 0.01, 0.1, 1e4


def physics_of(phases: dict, force_field: dict, **dem: object) -> dict:
    return {
        "formulation": CONFIG["formulation"] | {"phases": phases, "unit_mass_pg": 100.0},
        "force_field": force_field,
        "dem": CONFIG["dem"] | dem,
        "slurry": {"mass_units": 1.0, "thickness_ratio": 1.2, "seed": 7},
    }


def test_same_numbers_for_a_pair_are_no_difference():
    """The commands of before there were pairs, but for numbers that differ."""
    types = particle_types(PHASES)
    without = CONFIG["force_field"]
    styles = "gran/hertz/history 200000.0 57142.85714285714 30.0 15.0 0.015 1"
    assert forcefield.contact_styles(types, without) == styles
    same = without | {"pairs": {"hard-soft": {"friction": 0.015, "epsilon_fj_per_um": 1.0}}}
    for make in (forcefield.contact_styles, forcefield.coefficients):
        assert make(types, same) == make(types, without)
        assert make(types, {key: without[key] for key in ("lennard_jones", "granular_hertz")}) == make(types, without)
    assert forcefield.contact_styles(types, FORCE_FIELD).count("gran/hertz/history") == 4
    # LAMMPS refuses an instance that no pair uses
    alone = [t for t in types if t.phase == "soft"]
    soft = forcefield.contact_styles(alone, FORCE_FIELD)
    assert soft == "gran/hertz/history 100000.0 28571.42857142857 30.0 15.0 0.1 1"
    assert "pair_coeff * * gran/hertz/history\n" in forcefield.coefficients(alone, FORCE_FIELD)


def forces_fn(folder: Path, types: list, force_field: dict) -> dict[tuple[int, int], np.ndarray]:
    """Forces on the second of two particles of each pair of types: (3, 3), at rest, and moving along x and along y."""
    pairs = list(combinations_with_replacement(types, 2))
    position_um = []
    for k, (a, b) in enumerate(pairs):
        at_um = np.array([0, 10.0 * k - 5 * len(pairs), 0])
        position_um += [at_um, at_um + np.array([(a.diameter_um + b.diameter_um) / 2 - OVERLAP_UM, 0, 0])]
    of_type = np.array([t.type for pair in pairs for t in pair])
    half_um = np.array([10.0, 5.0 * len(pairs) + 5, 10.0])
    write_data(folder / "pushed_off.data", "pairs", types, of_type, np.array(position_um), -half_um, half_um)
    (folder / "coefficients.lmp").write_text(forcefield.coefficients(types, force_field))
    begin = SCRIPTS["start.lmp"].partition("velocity")[0]
    lines = [begin, f"group second id 2:{len(of_type)}:2", "timestep 1.0e-9"]
    for k, velocity in enumerate(("0 0 0", f"{SLOW_UM_US} 0 0", f"0 {FAST_UM_US} 0")):
        lines += [f"velocity second set {velocity}", "run 1"]  # nothing moves them; friction needs a step
        lines += [f"write_dump second custom forces_{k}.dump id fx fy fz modify sort id format float %.15g"]
    (folder / "pairs.lmp").write_text("\n".join(lines) + "\n")
    physics = physics_of(PHASES, force_field) | {"force_field": force_field}
    variables = {**force_field_variables(physics), "coefficients": "coefficients.lmp"}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lammps_run, "SCRIPTS", folder)
        run_lammps(LAUNCHER, "pairs.lmp", variables, folder, "pairs.log")
    found = np.array([np.loadtxt(folder / f"forces_{k}.dump", skiprows=9)[:, 1:] for k in range(3)])
    return {(a.type, b.type): found[:, k] for k, (a, b) in enumerate(pairs)}


def test_two_particles_of_each_pair_feel_the_forces_in_closed_form(tmp_path):
    types = particle_types(PHASES)
    found = forces_fn(tmp_path, types, FORCE_FIELD)
    general = CONFIG["force_field"]["lennard_jones"] | CONFIG["force_field"]["granular_hertz"]
    for a, b in combinations_with_replacement(types, 2):
        own = PAIRS.get(f"{a.phase}-{b.phase}", PAIRS.get(f"{b.phase}-{a.phase}", {}))
        p = general | own
        mean_um = (a.diameter_um + b.diameter_um) / 2
        r_um, sigma_um = mean_um - OVERLAP_UM, p["sigma_factor"] * mean_um
        epsilon_fj = p["epsilon_fj_per_um"] * np.sqrt(a.diameter_um * b.diameter_um)
        attraction = 24 * epsilon_fj * (2 * (sigma_um / r_um) ** 12 - (sigma_um / r_um) ** 6) / r_um
        radius_um = a.diameter_um * b.diameter_um / (2 * (a.diameter_um + b.diameter_um))
        mass_pg = a.mass_pg * b.mass_pg / (a.mass_pg + b.mass_pg)
        area_um = np.sqrt(radius_um * OVERLAP_UM)
        hertz = area_um * p["normal_stiffness_kpa"] * OVERLAP_UM
        damping = area_um * mass_pg * p["normal_damping_per_um_us"] * SLOW_UM_US
        at_rest, apart, aside = found[a.type, b.type]
        assert at_rest == pytest.approx([hertz + attraction, 0, 0], rel=1e-9, abs=1e-9), (a, b)
        assert at_rest[0] - apart[0] == pytest.approx(damping, rel=1e-6), (a, b)
        assert aside == pytest.approx([hertz + attraction, -p["friction"] * hertz, 0], rel=1e-9, abs=1e-9), (a, b)


def wide() -> dict:
    """Physics of sizes from 0.4 to 1.6 um, for which each pair of sizes has a cutoff of its own."""
    phases = {"soft": phase(0.1, 0.8, {1.2: 1.0}), "hard": phase(0.9, 6.0, {0.4: 0.9, 0.6: 0.09, 1.6: 0.01})}
    force_field = CONFIG["force_field"] | {"pairs": {"hard-hard": {"friction": 0.5}}}
    return physics_of(phases, force_field, timestep_us=1e-3, pressure_damping_us=0.5)


@pytest.fixture(scope="module", params=["pairs", "wide"])
def dense(request, tmp_path_factory, generate) -> tuple[Path, dict]:
    """Folder of a dense slurry at step 1500, and the variables of its segments."""
    folder = tmp_path_factory.mktemp("dense")
    physics = wide()
    if request.param == "pairs":
        physics = physics_of(PHASES, FORCE_FIELD, pressure_damping_us=1.0)
    assert neighbour_lists.is_wide(particle_types(physics["formulation"]["phases"])) == (request.param == "wide")
    generate(folder, physics)
    variables = {
        **force_field_variables(json.loads((folder / "inputs.json").read_text())["physics"]),
        "data": "initial.data",
        "coefficients": "coefficients.lmp",
        "push_off": "push_off.lmp",
        "push_off_iterations": 500,
        "velocity_seed": 3,
        "thermo_every_steps": 50,
        "frame_every_steps": 50,
    }
    for script in ("push_off", "start"):
        run_lammps(LAUNCHER, f"{script}.lmp", variables, folder, f"{script}.log")
    segment(folder, variables, 0, 1500)
    return folder, variables


def segment(folder: Path, variables: dict, first: int, last: int) -> None:
    run_lammps(LAUNCHER, "slurry.lmp", {**variables, "from": first, "to": last}, folder, f"segment_{last}.log")
    assert "Unused restart file" not in (folder / f"segment_{last}.log").read_text()


@pytest.mark.parametrize("script", ["displace", "continue", "drive", "relax"])
def test_other_stages_have_the_forces_of_each_pair(dense, tmp_path, script):
    """And keep each contact history, where they go on from a restart file."""
    folder, variables = dense
    for name in ("coefficients.lmp", "step_1500.restart", "pushed_off.data"):
        shutil.copyfile(folder / name, tmp_path / name)
    edges = {f"final_l{axis}_um": 3.0 for axis in "xyz"}
    own = {"restart": "step_1500.restart", "from": 1500, "displacement_um": 1e-6, "displacement_seed": 5}
    own |= {"start_temperature_k": 3.0e4}
    rounds = {"max_rounds": 1, "round_steps": 50, "flat_within": 0.1, "pressure_within": 0.1, "steps": 50}
    run_lammps(LAUNCHER, f"{script}.lmp", variables | own | rounds | edges, tmp_path, "log.lammps")
    log = (tmp_path / "log.lammps").read_text()
    assert "Unused restart file" not in log and "WARNING" not in log
    assert (f"pair_style      hybrid/overlay lj/cut 1.0 {variables['contact_styles']}\n" in log) == (script == "relax")


def test_a_tape_has_the_forces_of_each_pair(dense, tmp_path):
    """The drying starts from places alone, and takes the forces of the slurry times its factors."""
    folder, _ = dense
    inputs = json.loads((folder / "inputs.json").read_text())
    *_, last = read_dump(folder / "frames_1500.dump")
    frame = as_frame(last, 30, inputs["physics"]["dem"]["timestep_us"])
    id, type = (column.astype(int) for column in last.values[:, :2].T)
    write_frames(tmp_path / "slurry.h5", particles_of(inputs["types"], id, type), [frame], {"slurry": "A"})
    settings = CONFIG["drying"] | {"phase": "soft", "stages": 2, "steps_per_stage": 200, "rest_steps": 100}
    settings |= {"force_field": {"friction": 0.5, "attraction_factor": 2.0, "stiffness_factor": 0.5}}
    settings |= {key: CONFIG["relaxation"][key] for key in ("pressure_damping_steps", "start_thermal_share")}
    with read_frames(tmp_path / "slurry.h5") as store:
        tape = dry(store, inputs, settings, LAUNCHER, tmp_path, print)
    assert tape.rows[-1]["thickness_um"] < tape.rows[0]["thickness_um"]
    dried = dry_force_field(inputs["physics"]["force_field"], settings["force_field"])
    types = drying_types(particle_types(inputs["physics"]["formulation"]["phases"]), settings, 0.0)
    style = f"pair_style      hybrid/overlay lj/cut 1.0 {forcefield.contact_styles(types, dried)}\n"
    assert style in (tmp_path / "dry.log").read_text()
    assert (tmp_path / "stage_2.lmp").read_text().endswith(forcefield.coefficients(types, dried))


def test_chain_goes_on_bit_by_bit_and_keeps_each_contact_history(dense, tmp_path, monkeypatch):
    """In another folder from a restart file alone; and all of it on the trajectory of one process."""
    folder, variables = dense
    stops = range(1500, 1801, 100)
    for first, last in pairwise(stops):
        segment(folder, variables, first, last)
    for name in ("coefficients.lmp", "step_1700.restart"):
        shutil.copyfile(folder / name, tmp_path / name)
    segment(tmp_path, variables, 1700, 1800)
    for name in ("frames_1800.dump", "step_1800.restart"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()
    *_, chain = read_dump(folder / "frames_1800.dump")
    assert chain.values[:, -1].mean() > 3  # contacts

    scripts = tmp_path / "scripts"
    scripts.mkdir()
    monkeypatch.setattr(lammps_run, "SCRIPTS", scripts)
    runs = "\n".join(f"run {last} upto" for last in stops[1:])
    (scripts / "slurry.lmp").write_text(SCRIPTS["slurry.lmp"].replace("run             ${to} upto", runs))
    shutil.copyfile(folder / "step_1500.restart", tmp_path / "step_1500.restart")
    segment(tmp_path, variables, 1500, 1800)
    *_, one_process = read_dump(tmp_path / "frames_1800.dump")
    np.testing.assert_allclose(chain.values, one_process.values, rtol=0, atol=1e-10)
