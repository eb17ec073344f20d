"""A perturbed run without displacement is the DEM run itself; with a hair of it, it drifts away."""

import re
import signal
import subprocess

import numpy as np
import pytest

from damage import flip
from slurrycast.analysis.errors import coordinate_errors
from slurrycast.data.frames import read_frames
from test_run_slurry import REPEATED, killed, wait_until


@pytest.fixture(scope="module")
def perturbed(slurry, command):
    """Command line of a perturbed run that starts at frame 10, with its files in a folder."""

    def build(folder, target_frame, displacement_um, restart_frame=10):
        names = {"inputs": "inputs.json", "coefficients": "coefficients.lmp", "run": "run.json"}
        names |= {"frames": "frames.h5"}
        paths = {option: slurry / name for option, name in names.items()}
        paths |= {"restart": slurry / f"frame_{restart_frame}.restart", "perturbed": folder / "perturbed.h5"}
        frames = {"first_frame": 10, "target_frame": target_frame}
        work = folder / "work folder"
        return command("run_perturbed", **paths, **frames, displacement_um=displacement_um, work=work)

    return build


@pytest.mark.parametrize(("target_frame", "segments_differ"), [(40, True), (120, False)])
def test_undisturbed_perturbed_run_is_the_dem_run(perturbed, slurry, tmp_path, target_frame, segments_differ):
    """To the end it has the segments of the original, and every bit of it."""
    k, tolerance = target_frame, 1e-7 * segments_differ
    subprocess.run(perturbed(tmp_path, k, 0), check=True)
    with read_frames(tmp_path / "perturbed.h5") as store, read_frames(slurry / "frames.h5") as dem:
        for name in ("position_um", "scaled_position", "coordination", "box"):
            np.testing.assert_allclose(getattr(store, name)(k), getattr(dem, name)(k), rtol=0, atol=tolerance)
        assert store.frame_numbers.tolist() == [k]
        assert (store.steps[0], store.times_us[0]) == (dem.steps[k], pytest.approx(dem.times_us[k]))
        np.testing.assert_array_equal(store.particles.id, dem.particles.id)
        expected = {"slurry": "A", "stage": "perturbed", "first_frame": 10, "displacement_um": 0}
        assert {name: store.attributes[name] for name in expected} == expected
    assert not (tmp_path / "work folder").exists()


@pytest.mark.parametrize("target_frame", [11, 120])
def test_displaced_perturbed_run_drifts_away(perturbed, slurry, tmp_path, target_frame):
    subprocess.run(perturbed(tmp_path, target_frame, 1e-6), check=True)
    with read_frames(tmp_path / "perturbed.h5") as store, read_frames(slurry / "frames.h5") as dem:
        mse_um2 = coordinate_errors(dem.position_um(target_frame), store.position_um(target_frame))["all"].mse_um2
        edge_um = dem.box(target_frame)[1].max()
    if target_frame == 11:  # displacements spread evenly over +-1e-6 um have a variance of 1/3 of its square
        assert mse_um2 == pytest.approx(1e-12 / 3, rel=0.3)
    else:  # what was a hair has grown, but stays far below places drawn at random
        assert 1e-12 < mse_um2 < 0.1 * edge_um**2 / 12


def test_restart_file_of_another_frame_is_refused(perturbed, tmp_path):
    """By the second attempt too: what the first one wrote of it counts for nothing."""
    for _ in range(2):
        result = subprocess.run(perturbed(tmp_path, 11, 0, restart_frame=1), capture_output=True, text=True)
        assert result.returncode == 1
        assert result.stderr.endswith("frame_1.restart: of step 50, frame 10 is 500\n")
    assert not (tmp_path / "perturbed.h5").exists()


def test_target_before_the_start_is_refused(perturbed, tmp_path):
    result = subprocess.run(perturbed(tmp_path, 10, 0), capture_output=True, text=True)
    assert result.returncode == 2
    assert result.stderr.endswith("--first-frame 10: must be from 0 to below --target-frame 10\n")


@pytest.fixture(scope="module")
def undisturbed(perturbed, tmp_path_factory) -> bytes:
    """File of a perturbed run that nobody disturbed."""
    folder = tmp_path_factory.mktemp("undisturbed")
    subprocess.run(perturbed(folder, 120, 1e-6), check=True)
    return (folder / "perturbed.h5").read_bytes()


def test_perturbed_run_killed_in_its_second_segment_goes_on_and_ends_with_every_bit(perturbed, undisturbed, tmp_path):
    work, attempts = tmp_path / "work folder", tmp_path / "attempts"
    command = [*perturbed(tmp_path, 120, 1e-6), "--attempts", str(attempts)]
    killed(command, work / "segment_3000.log", everything=True)
    assert (work / "segment_2000.json").exists() and not (tmp_path / "perturbed.h5").exists()
    result = subprocess.run(command, check=True, capture_output=True, text=True)
    assert re.search(r"\[A perturbed run\] goes on from step [23]000 of 6000\n", result.stdout)
    assert (tmp_path / "perturbed.h5").read_bytes() == undisturbed
    assert not work.exists()
    assert sorted(path.name for path in attempts.glob("attempt_?.log")) == ["attempt_1.log", "attempt_2.log"]


@pytest.mark.parametrize("name", [pytest.param("step_500.restart", marks=REPEATED), "step_2000.restart"])
def test_damaged_part_of_a_perturbed_run_is_named_and_done_again(perturbed, undisturbed, tmp_path, name):
    work = tmp_path / "work folder"
    killed(perturbed(tmp_path, 120, 1e-6), work / "segment_3000.log", everything=True)
    flip(work / name)
    result = subprocess.run(perturbed(tmp_path, 120, 1e-6), check=True, capture_output=True, text=True)
    assert f"{work / name}: truncated, or not what " in result.stdout
    assert "goes on" not in result.stdout
    assert (tmp_path / "perturbed.h5").read_bytes() == undisturbed


def test_perturbed_run_of_other_settings_does_not_go_on_from_what_was_left(perturbed, tmp_path):
    work = tmp_path / "work folder"
    killed(perturbed(tmp_path, 120, 1e-5), work / "segment_3000.log", everything=True)
    result = subprocess.run(perturbed(tmp_path, 11, 1e-6), check=True, capture_output=True, text=True)
    assert f"{work}: left by a run with other inputs; starting anew" in result.stdout


@pytest.mark.slow
@pytest.mark.full  # see test_run_slurry.py
def test_perturbed_run_stops_between_segments_when_its_budget_is_used_up(perturbed, undisturbed, tmp_path):
    command = perturbed(tmp_path, 120, 1e-6)
    for step in (2000, 3000, 4000):
        result = subprocess.run([*command, "--budget-min", "0.001"], capture_output=True, text=True)
        assert result.returncode == 75
        assert result.stderr.startswith(f"[A perturbed run] stopped at step {step}: the next segment takes about ")
        assert not (tmp_path / "perturbed.h5").exists()
    subprocess.run(command, check=True)
    assert (tmp_path / "perturbed.h5").read_bytes() == undisturbed


@pytest.mark.slow
@pytest.mark.full  # see test_run_slurry.py
def test_terminated_perturbed_run_stops_and_goes_on(perturbed, undisturbed, tmp_path):
    command = perturbed(tmp_path, 120, 1e-6)
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    wait_until((tmp_path / "work folder" / "segment_2000.json").exists, process)
    process.send_signal(signal.SIGTERM)
    said = process.communicate(timeout=30)[1]
    assert process.returncode == 75
    assert re.match(r"\[A perturbed run\] stopped .*by SIGTERM", said)
    subprocess.run(command, check=True)
    assert (tmp_path / "perturbed.h5").read_bytes() == undisturbed
