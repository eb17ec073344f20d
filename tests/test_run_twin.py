"""A twin without displacement is the DEM run itself; with a hair of it, it drifts away."""

import json
import subprocess

import numpy as np
import pytest

from slurrycast.errors import coordinate_errors
from slurrycast.frames import read_frames


@pytest.fixture
def twin(slurry, tmp_path, command):
    """Command line of a twin that starts at frame 10."""

    def build(target_frame, displacement_um, restart_frame=10):
        return command(
            "run_twin",
            restart=slurry / f"frame_{restart_frame}.restart",
            inputs=slurry / "inputs.json",
            coefficients=slurry / "coefficients.lmp",
            frames=slurry / "frames.h5",
            first_frame=10,
            target_frame=target_frame,
            displacement_um=displacement_um,
            work=tmp_path / "work folder",
            twin=tmp_path / "twin.h5",
            cost=tmp_path / "cost.json",
        )

    return build


def test_undisturbed_twin_is_the_dem_run(twin, slurry, tmp_path):
    subprocess.run(twin(40, 0), check=True)
    with read_frames(tmp_path / "twin.h5") as store, read_frames(slurry / "frames.h5") as dem:
        np.testing.assert_allclose(store.position_um(40), dem.position_um(40), rtol=0, atol=1e-7)
        np.testing.assert_allclose(store.scaled_position(40), dem.scaled_position(40), rtol=0, atol=1e-7)
        np.testing.assert_array_equal(store.coordination(40), dem.coordination(40))
        np.testing.assert_allclose(store.box(40), dem.box(40), rtol=1e-8)
        assert store.frame_numbers.tolist() == [40]
        assert (store.steps[0], store.times_us[0]) == (dem.steps[40], pytest.approx(dem.times_us[40]))
        np.testing.assert_array_equal(store.particles.id, dem.particles.id)
        assert {name: store.attributes[name] for name in ("slurry", "stage", "first_frame", "displacement_um")} == {
            "slurry": "A",
            "stage": "twin",
            "first_frame": 10,
            "displacement_um": 0,
        }
    cost = json.loads((tmp_path / "cost.json").read_text())
    assert (cost["stage"], cost["slurry"], cost["steps"]) == ("run_twin", "A", 30 * 50)
    assert not (tmp_path / "work folder").exists()


@pytest.mark.parametrize("target_frame", [11, 120])
def test_displaced_twin_drifts_away(twin, slurry, tmp_path, target_frame):
    subprocess.run(twin(target_frame, 1e-6), check=True)
    with read_frames(tmp_path / "twin.h5") as store, read_frames(slurry / "frames.h5") as dem:
        mse_um2 = coordinate_errors(dem.position_um(target_frame), store.position_um(target_frame))["all"].mse_um2
        edge_um = dem.box(target_frame)[1].max()
    if target_frame == 11:  # displacements spread evenly over +-1e-6 um have a variance of 1/3 of its square
        assert mse_um2 == pytest.approx(1e-12 / 3, rel=0.3)
    else:  # what was a hair has grown, but stays far below places drawn at random
        assert 1e-12 < mse_um2 < 0.1 * edge_um**2 / 12


def test_restart_file_of_another_frame_is_refused(twin, tmp_path):
    result = subprocess.run(twin(11, 0, restart_frame=1), capture_output=True, text=True)
    assert result.returncode == 1
    assert result.stderr.endswith("frame_1.restart: of step 50, frame 10 is 500\n")
    assert not (tmp_path / "twin.h5").exists()


def test_target_before_the_start_is_refused(twin):
    result = subprocess.run(twin(10, 0), capture_output=True, text=True)
    assert result.returncode == 2
    assert result.stderr.endswith("--first-frame 10: must be from 0 to below --target-frame 10\n")
