"""A slurry of some 80 particles that LAMMPS dries with low and with high friction."""

import json
import signal
import subprocess
import time

import numpy as np
import pytest

from configurations import load
from data_files import atoms, bounds_um
from script_runs import refusal, run_script, written
from slurrycast.data.frames import read_frames
from slurrycast.data.tables import read_table
from slurrycast.dem.recipe import sphere_volume_um3
from structures import frame, write_store

FRICTIONS = (0.015, 0.5)
DRYING = load("config")["drying"] | {"stages": 4, "steps_per_stage": 300, "rest_steps": 2000}
SETTINGS = {key: value for key, value in DRYING.items() if key != "sources"} | {
    key: load("config")["relaxation"][key] for key in ("pressure_damping_steps", "start_thermal_share")
}


def options(slurry, folder, **settings):
    """Options of dry_slurry that dry the end of the DEM into a folder."""
    files = {"structure": slurry / "frames.h5", "inputs": slurry / "inputs.json", "work": folder / "work"}
    files |= {"dried_data": folder / "dried.data", "dried": folder / "dried.h5", "table": folder / "drying.csv"}
    return files | {"cost": folder / "cost.json", "settings": json.dumps(SETTINGS | settings)}


@pytest.fixture(scope="module")
def tapes(slurry, tmp_path_factory):
    """Folder with the tape of each friction."""
    folders = {friction: tmp_path_factory.mktemp("tape") for friction in FRICTIONS}
    for friction, folder in folders.items():
        force_field = SETTINGS["force_field"] | {"friction": friction}
        done = run_script("dry_slurry", **options(slurry, folder, force_field=force_field))
        assert done.returncode == 0, done.stderr
    return folders


@pytest.fixture(scope="module")
def tape(tapes):
    """Folder of the tape with high friction."""
    return tapes[0.5]


def test_thickness_alone_shrinks(slurry, tape):
    with read_frames(slurry / "frames.h5") as wet, read_frames(tape / "dried.h5") as dry:
        before_um, after_um = wet.box(wet.last)[1], dry.box(dry.last)[1]
        np.testing.assert_allclose(after_um[:2], before_um[:2], rtol=1e-14)
        assert 0.55 < after_um[2] / before_um[2] < 0.85
        names = ("slurry_thickness_um", "tape_thickness_um")
        assert [dry.attributes[name] for name in names] == pytest.approx([before_um[2], after_um[2]])
        np.testing.assert_allclose(np.ptp(bounds_um(tape / "dried.data"), axis=1), after_um, rtol=1e-12)


def test_mass_of_ceramic_and_organics_is_conserved(slurry, tape):
    rows = atoms(tape / "dried.data")
    mass_pg = rows[:, 3] * sphere_volume_um3(rows[:, 2])
    with read_frames(slurry / "frames.h5") as wet, read_frames(tape / "dried.h5") as dry:
        np.testing.assert_array_equal(dry.particles.id, rows[:, 0])
        np.testing.assert_allclose(dry.particles.mass_pg, mass_pg, rtol=1e-12)
        np.testing.assert_allclose(2 * dry.particles.radius_um, rows[:, 2], rtol=1e-12)
        for name in wet.particles.phase_names:
            left = 1 - SETTINGS["solvent_mass_fraction"] if name == "BDPD" else 1
            expected_pg = left * wet.particles.mass_pg[wet.particles.in_phase(name)].sum()
            assert mass_pg[dry.particles.in_phase(name)].sum() == pytest.approx(expected_pg, rel=1e-9)


def test_friction_makes_the_tape_porous(tapes):
    slurry, *dried = (
        read_table(tapes[friction] / "drying.csv").packing_fraction.iloc[row]
        for friction, row in ((0.5, 0), *((friction, -1) for friction in FRICTIONS))
    )
    low, high = (1 - packing for packing in dried)
    assert high - low > 0.03
    assert abs(low - (1 - slurry)) < 0.03  # with the friction of the slurry


def test_table_follows_the_drying(slurry, tape):
    table = read_table(tape / "drying.csv")
    assert table.step.tolist() == [0, 300, 600, 900, 1200, 3200]
    assert table.solvent_left.tolist() == [1, 0.75, 0.5, 0.25, 0, 0]
    assert (np.diff(table.thickness_um) < 0).all()
    with read_frames(slurry / "frames.h5") as wet, read_frames(tape / "dried.h5") as dry:
        ends = [store.density_g_cm3(store.last) for store in (wet, dry)]
        assert table.density_g_cm3.iloc[[0, -1]].tolist() == pytest.approx(ends, rel=1e-8)


def test_tape_says_where_it_comes_from_and_how_it_ended(slurry, tape, tmp_path):
    with read_frames(slurry / "frames.h5") as wet, read_frames(tape / "dried.h5") as dry:
        assert (dry.frame_numbers.tolist(), dry.steps.tolist()) == ([wet.last], [3200])
        assert dry.attributes["stage"] == "dried"
        assert json.loads(dry.attributes["drying"]) == SETTINGS
        assert json.loads(dry.attributes["seeds"]).keys() - json.loads(wet.attributes["seeds"]).keys() == {"drying"}
        assert dry.attributes["pressure_kpa"] == pytest.approx(101.325, rel=0.1)
        assert dry.attributes["kinetic_share"] < 1e-4
    cost = json.loads((tape / "cost.json").read_text())
    assert (cost["stage"], cost["surrogate"], cost["slurry"], cost["steps"]) == ("dry_slurry", "-", "A", 3200)
    assert not (tape / "work").exists()
    bounds = {"pressure_kpa": 101.325, "max_kinetic_share": 1e-12, "pressure_within": 0.5, "temperature_k": 0}
    (row,) = written("measure_drying", tmp_path / "ends.csv", dried=tape / "dried.h5", **bounds).itertuples()
    assert (row.source, row.slurry) == ("dem", "A")
    assert row.warning.startswith("not at rest: kinetic energy is")


def test_failed_drying_says_so_on_one_line_and_leaves_no_output(slurry, tmp_path):
    done = run_script("dry_slurry", **options(slurry, tmp_path, timestep_factor=250))
    assert done.returncode == 1
    assert done.stderr.startswith("error: LAMMPS") and done.stderr.count("\n") == 1
    assert done.stderr.endswith(f"; log: {tmp_path / 'work' / 'dry.log'}\n")
    assert [path.name for path in tmp_path.iterdir()] == ["work"]


def test_a_killed_drying_leaves_no_output_and_ends_the_same_when_it_is_repeated(slurry, tape, tmp_path, command):
    """The driver alone is killed, so that the next attempt may meet its LAMMPS."""
    again = options(slurry, tmp_path, force_field=SETTINGS["force_field"] | {"friction": 0.5})
    with subprocess.Popen(command("dry_slurry", **again), stdout=subprocess.DEVNULL) as driver:
        while driver.poll() is None and not (tmp_path / "work" / "dry.log").exists():
            time.sleep(0.01)
        driver.kill()
    assert driver.returncode == -signal.SIGKILL
    assert [path.name for path in tmp_path.iterdir()] == ["work"]
    done = run_script("dry_slurry", **again)
    assert done.returncode == 0, done.stderr
    for name in ("dried.h5", "dried.data", "drying.csv"):
        assert (tmp_path / name).read_bytes() == (tape / name).read_bytes(), name
    assert not (tmp_path / "work").exists()


def test_a_structure_that_was_cut_is_refused(slurry, tmp_path):
    sound = (slurry / "frames.h5").read_bytes()
    structure, outputs = tmp_path / "frames.h5", tmp_path / "outputs"
    structure.write_bytes(sound[: len(sound) // 2])
    done = run_script("dry_slurry", **options(slurry, outputs) | {"structure": structure})
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert done.stderr.startswith(f"error: {structure}: not a readable frame store (")
    assert not outputs.exists()


def test_a_structure_that_was_not_dried_has_no_end_to_measure(tmp_path):
    store = write_store(tmp_path / "relaxed.h5", [frame(0, np.zeros((1, 3)), np.ones(3))], slurry="A")
    bounds = {"pressure_kpa": 101.325, "max_kinetic_share": 1e-4, "pressure_within": 0.02, "temperature_k": 300}
    said = refusal("measure_drying", tmp_path / "ends.csv", dried=store, **bounds)
    assert said.startswith(f"error: {store}: no attribute slurry_thickness_um, tape_thickness_um, temperature_k")
