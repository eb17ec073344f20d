"""A microstructure with random overlaps, wrapped into its box and relaxed by LAMMPS."""

import json
import subprocess

import numpy as np
import pytest

from configurations import load
from data_files import atoms, bounds_um
from script_runs import run_script
from slurrycast.data.frames import read_frames, write_frames
from slurrycast.data.periodic import wrap
from slurrycast.dem.particles import total_volume_um3
from structures import frame

SETTINGS = {"steps": 3000, "push_off_iterations": 200, "pressure_damping_steps": 1500, "start_thermal_share": 2.5e-4}
PARTICLES = ("id", "type", "phase", "size_class", "radius_um", "mass_pg")


@pytest.fixture(scope="module")
def relax_command(slurry, command):
    """Command line that relaxes the prediction of one folder and writes to another."""

    def build(inputs, outputs, coefficients="coefficients.lmp"):
        files = {"wrapped": inputs / "wrapped.data", "predicted": inputs / "predicted.h5"}
        files |= {"inputs": slurry / "inputs.json", "coefficients": slurry / coefficients}
        files |= {"push_off": slurry / "push_off.lmp", "work": outputs / "work folder", "cost": outputs / "cost.json"}
        files |= {"relaxed_data": outputs / "relaxed.data", "relaxed": outputs / "relaxed.h5"}
        return command("relax_slurry", **files, settings=json.dumps(SETTINGS))

    return build


@pytest.fixture(scope="module")
def relaxed(slurry, tmp_path_factory, command, relax_command):
    """Folder with a prediction as bad as can be, random places some boxes away, and what became of it."""
    folder = tmp_path_factory.mktemp("relaxed slurry")
    rng = np.random.default_rng(3)
    with read_frames(slurry / "frames.h5") as store:
        edges_um = 1.1 * store.box(120)[1]
        scattered = frame(120, rng.uniform(-2.5, 2.5, (len(store.particles), 3)) * edges_um, edges_um)
        attributes = {"slurry": "A", "surrogate": "random", "stage": "predicted", "box_scale": 1.1}
        write_frames(folder / "predicted.h5", store.particles, [scattered], attributes)
    files = {"wrapped": folder / "wrapped.data", "predicted": folder / "predicted.h5", "inputs": slurry / "inputs.json"}
    wrap = command("wrap_slurry", **files, cost=folder / "wrap_cost.json")
    for words in (wrap, relax_command(folder, folder)):
        subprocess.run(words, check=True)
    return folder


def test_wrapped_data_are_the_prediction_inside_its_box(relaxed):
    rows = atoms(relaxed / "wrapped.data")
    with read_frames(relaxed / "predicted.h5") as store:
        lower_um, edges_um = store.box(120)
        assert ((rows[:, 4:7] >= lower_um) & (rows[:, 4:7] < lower_um + edges_um)).all()
        np.testing.assert_array_equal(rows[:, 4:7], wrap(store.position_um(120), lower_um, edges_um))
        np.testing.assert_array_equal(rows[:, 0], store.particles.id)
        np.testing.assert_array_equal(rows[:, 1], store.particles.type)
        np.testing.assert_allclose(rows[:, 2], 2 * store.particles.radius_um)


def test_relaxed_microstructure_is_sane(relaxed):
    with read_frames(relaxed / "relaxed.h5") as store:
        k = store.last
        position_um, (lower_um, edges_um) = store.position_um(k), store.box(k)
        assert np.isfinite(position_um).all()
        assert store.density_g_cm3(k) == pytest.approx(2.24, rel=0.03)
        assert 5.5 < store.coordination(k).mean() < 7.5
        np.testing.assert_allclose(lower_um, -edges_um / 2, atol=1e-9)
        np.testing.assert_allclose(position_um, lower_um + store.scaled_position(k) * edges_um, rtol=0, atol=1e-9)
        shift_um = position_um[:, None] - position_um[None]
        shift_um -= edges_um * np.rint(shift_um / edges_um)
        reach_um = store.particles.radius_um[:, None] + store.particles.radius_um[None]
        closeness = np.linalg.norm(shift_um, axis=2) / reach_um + 2 * np.eye(len(position_um))
        assert closeness.min() > 0.9


def test_relaxed_store_says_where_it_comes_from(relaxed):
    with read_frames(relaxed / "relaxed.h5") as store, read_frames(relaxed / "predicted.h5") as predicted:
        assert store.frame_numbers.tolist() == [120]
        assert store.steps.tolist() == [3000]
        assert store.times_us.tolist() == pytest.approx([6.0])
        for name in ("slurry", "surrogate", "box_scale"):
            assert store.attributes[name] == predicted.attributes[name]
        assert store.attributes["stage"] == "relaxed"
        assert json.loads(store.attributes["relaxation"]) == SETTINGS
        assert store.particles.phase_names == predicted.particles.phase_names
        for name in PARTICLES:
            np.testing.assert_array_equal(getattr(store.particles, name), getattr(predicted.particles, name))


def test_relaxed_data_file_holds_the_same_microstructure(relaxed):
    rows = atoms(relaxed / "relaxed.data")
    with read_frames(relaxed / "relaxed.h5") as store:
        k = store.last
        lower_um, edges_um = store.box(k)
        shift_um = rows[:, 4:7] - store.position_um(k)
        shift_um -= edges_um * np.rint(shift_um / edges_um)
        np.testing.assert_allclose(shift_um, 0, atol=1e-9)
        np.testing.assert_allclose(rows[:, 2], 2 * store.particles.radius_um)
        expected_um = np.column_stack([lower_um, lower_um + edges_um])
        np.testing.assert_allclose(bounds_um(relaxed / "relaxed.data"), expected_um, rtol=1e-12)


def test_cost_and_work_folder(relaxed):
    cost = json.loads((relaxed / "cost.json").read_text())
    assert (cost["stage"], cost["surrogate"], cost["slurry"], cost["steps"]) == ("relax_slurry", "random", "A", 3000)
    assert cost["cpu_s"] > 0.05
    assert not (relaxed / "work folder").exists()


def test_failed_relaxation_says_so_on_one_line_and_leaves_no_output(relaxed, relax_command, tmp_path):
    words = relax_command(relaxed, tmp_path, coefficients="push_off.lmp")  # not those of the real forces
    result = subprocess.run(words, capture_output=True, text=True)
    assert result.returncode == 1
    assert result.stderr.startswith("error: LAMMPS: ERROR: ")
    assert result.stderr.endswith(f"; log: {tmp_path / 'work folder' / 'relax.log'}\n")
    assert [path.name for path in tmp_path.iterdir()] == ["work folder"]


@pytest.mark.parametrize(
    ("script", "structure", "outputs"),
    [
        ("wrap_slurry", "predicted", ["wrapped", "cost"]),
        ("relax_slurry", "predicted", ["relaxed", "relaxed_data", "cost"]),
        ("dry_slurry", "structure", ["dried", "dried_data", "table", "cost"]),
        ("calibrate_drying", "structure", ["table", "cost"]),
        ("measure_microstructure", "structure", ["table", "cost"]),
    ],
)
def test_inputs_of_another_slurry_are_refused(slurry, tmp_path, script, structure, outputs):
    inputs = json.loads((slurry / "inputs.json").read_text())
    other, written = tmp_path / "inputs.json", tmp_path / "written"
    other.write_text(json.dumps(inputs | {"slurry": "B"}))
    options = {structure: slurry / "frames.h5", "inputs": other} | {name: written / name for name in outputs}
    if script == "relax_slurry":
        options |= {"wrapped": slurry / "initial.data"}
        options |= {name: slurry / f"{name}.lmp" for name in ("coefficients", "push_off")}
    if script in ("relax_slurry", "dry_slurry", "calibrate_drying"):
        settings = load("config")["drying"] | SETTINGS
        options |= {"work": tmp_path / "work", "settings": json.dumps(settings)}
    done = run_script(script, **options)
    held, said = (f"slurry {name} with {inputs['particles']} particles" for name in ("A", "B"))
    assert done.stderr == f"error: {slurry / 'frames.h5'}: {held}, but the inputs are of {said}\n"
    assert (done.returncode, written.exists()) == (1, False)


@pytest.mark.parametrize(("scale", "ends"), [(0.9, True), (0.6, False)])
def test_a_box_too_small_to_push_the_particles_apart(slurry, command, relax_command, tmp_path, scale, ends):
    """A box a little too small comes to rest with what overlaps are left, a smaller one does not."""
    inputs, outputs = tmp_path / "inputs", tmp_path / "outputs"
    with read_frames(slurry / "frames.h5") as store:
        small = frame(120, scale * store.position_um(120), scale * store.box(120)[1])
        packing = total_volume_um3(store.particles) / np.prod(small.edges_um)
        attributes = {"slurry": "A", "surrogate": "small", "stage": "predicted", "box_scale": scale}
        write_frames(inputs / "predicted.h5", store.particles, [small], attributes)
    files = {"wrapped": inputs / "wrapped.data", "predicted": inputs / "predicted.h5", "inputs": slurry / "inputs.json"}
    subprocess.run(command("wrap_slurry", **files, cost=inputs / "cost.json"), check=True)
    result = subprocess.run(relax_command(inputs, outputs), capture_output=True, text=True)
    assert (result.returncode == 0) == (outputs / "relaxed.h5").exists() == ends
    said = (
        f"error: slurry A: push_off.lmp left overlaps, in a box with a packing fraction of {packing:.2f}: set "
        "relaxation.push_off_iterations higher, or predict a larger box; LAMMPS: ERROR: Lost atoms"
    )
    assert result.stderr.startswith("" if ends else said) and result.stderr.count("\n") == (not ends)
