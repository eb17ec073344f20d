"""The DEM of a small slurry: sane physics, all outputs, and the same numbers after a kill."""

import json
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import psutil
import pytest

from damage import flip, truncate
from data_files import atoms
from run_slurry import THERMO_COLUMNS, boundaries
from slurrycast.data.frames import read_frames
from slurrycast.data.periodic import minimum_image
from slurrycast.dem.lammps_dump import read_dump

REPEATED = [pytest.mark.slow, pytest.mark.full]  # in tests of work folders
RESULTS = ["dump.lammpstrj", "thermo.csv", *(f"frame_{k}.restart" for k in (1, 10, 60))]


def overlaps(position_um: np.ndarray, radius_um: np.ndarray, edges_um: np.ndarray) -> np.ndarray:
    """Overlap of each pair as a share of the sum of its radii; negative where the two do not touch."""
    first, second = np.triu_indices(len(radius_um), 1)
    distance_um = np.linalg.norm(minimum_image(position_um[first] - position_um[second], edges_um), axis=1)
    return 1 - distance_um / (radius_um[first] + radius_um[second])


def assert_same_results(folder: Path, expected: Path) -> None:
    for name in RESULTS:
        assert (folder / name).read_bytes() == (expected / name).read_bytes(), name
    run, expected_run = (json.loads((path / "run.json").read_text()) for path in (folder, expected))
    for timing in ("segments", "start"):
        assert len(run.pop(timing)) == len(expected_run.pop(timing))
    assert run == expected_run


@pytest.mark.parametrize(
    ("frame_steps", "last_frame", "segment_frames", "restart_frames", "steps"),
    [
        (50, 120, 40, [1, 10], [0, 50, 500, 2000, 4000, 6000]),
        (50, 10, 40, [1, 10], [0, 50, 500]),
        (50, 10, 4, [10, 1], [0, 50, 200, 400, 500]),
        (1, 120, 120, [], [0, 120]),
        (1, 121, 120, [120], [0, 120, 121]),
        (2, 8, 6, [9, 10], [0, 12, 16]),
    ],
)
def test_boundaries(frame_steps, last_frame, segment_frames, restart_frames, steps):
    assert boundaries(frame_steps, last_frame, segment_frames, restart_frames) == steps


def test_outputs_are_complete_and_extract_frames_removed_the_work_folder(slurry):
    assert [frame.step for frame in read_dump(slurry / "dump.lammpstrj")] == list(range(0, 6001, 50))
    assert not (slurry / "work").exists()
    run = json.loads((slurry / "run.json").read_text())
    assert (run["slurry"], run["steps"], run["frames_written"], run["ranks"]) == ("A", 6000, 121, 1)
    assert run["physics"] == json.loads((slurry / "inputs.json").read_text())["physics"]
    ends = [(segment["step_start"], segment["step_end"]) for segment in run["segments"]]
    assert ends == [(0, 50), (50, 500), (500, 2000), (2000, 3000), (3000, 4000), (4000, 6000)]
    assert all(segment["wall_s"] > 0 and segment["cpu_s"] > 0 for segment in [*run["segments"], run["start"]])
    assert run["lammps_version"] != "unknown"


def test_thermo_table_has_every_row_once_and_agrees_with_the_frames(slurry):
    """Density, box and contacts, worked out anew from the particles of each frame."""
    thermo = pd.read_csv(slurry / "thermo.csv")
    assert list(thermo.columns) == list(THERMO_COLUMNS.values())
    assert thermo["step"].tolist() == list(range(0, 6001, 50))
    np.testing.assert_allclose(thermo["time_us"], thermo["step"] * 2e-3, rtol=1e-9)
    thermo = thermo.set_index("step")
    with read_frames(slurry / "frames.h5") as store:
        for k in store.frame_numbers:
            row = thermo.loc[store.steps[k]]
            assert row["density_g_cm3"] == pytest.approx(store.density_g_cm3(k), rel=1e-6)
            assert row[["lx_um", "ly_um", "lz_um"]].tolist() == pytest.approx(store.box(k)[1], rel=1e-8)
            assert row["mean_contacts"] == pytest.approx(store.coordination(k).mean(), rel=1e-8)


def test_slurry_is_packed_and_at_the_pressure_asked_for(slurry):
    thermo = pd.read_csv(slurry / "thermo.csv")
    assert np.isfinite(thermo).all(axis=None)
    with read_frames(slurry / "frames.h5") as store:
        particles_um3 = (4 / 3 * np.pi * store.particles.radius_um**3).sum()
        assert particles_um3 / store.volume_um3(0) == pytest.approx(0.2, rel=1e-9)
        # a random packing of spheres: from its loose to somewhat above its dense limit, since sizes are mixed
        assert 0.55 < particles_um3 / store.volume_um3(120) < 0.72
        for k in (0, 60, 120):  # isotropic barostat: the box keeps its shape
            assert store.box(k)[1] / store.box(k)[1][0] == pytest.approx([1, 1, 1.2], rel=1e-9)
        # a contact of two counts for both
        position_um, radius_um = store.position_um(120), store.particles.radius_um
        touching = (overlaps(position_um, radius_um, store.box(120)[1]) > 0).sum()
        assert store.coordination(120).sum() == 2 * touching
        assert overlaps(position_um, radius_um, store.box(120)[1]).max() < 0.05
    end = thermo[thermo["step"] >= 5400]
    assert end["pressure_kpa"].mean() == pytest.approx(101.325, rel=0.02)
    assert end["density_g_cm3"].std() < 0.02
    assert thermo["temperature_k"].iloc[0] == pytest.approx(300, rel=1e-6)
    assert thermo["temperature_k"].iloc[-1] < thermo["temperature_k"].max() / 2  # motion has died down


def test_push_off_removes_the_overlaps_of_the_random_start(slurry):
    with read_frames(slurry / "frames.h5") as store:
        radius_um, edges_um = store.particles.radius_um, store.box(0)[1]
        assert overlaps(atoms(slurry / "initial.data")[:, 4:7], radius_um, edges_um).max() > 0.3
        assert overlaps(store.position_um(0), radius_um, edges_um).max() < 0.01


def test_slurry_that_ends_early_equals_the_start_of_the_whole_run(slurry, tmp_path, dem_command):
    """As role `new`; a work folder that another slurry left is discarded first."""
    work = tmp_path / "work"
    work.mkdir()
    (work / "identity").write_text("another slurry")
    shutil.copyfile(slurry / "frame_60.restart", work / "step_50.restart")
    (work / "segment_50.json").write_text('{"wall_s": 1.0, "cpu_s": 1.0}')
    result = subprocess.run(dem_command(slurry, tmp_path, 10), check=True, capture_output=True, text=True)
    assert f"{work}: left by a run with other inputs; starting anew" in result.stdout
    whole = (slurry / "dump.lammpstrj").read_bytes()
    start = (tmp_path / "dump.lammpstrj").read_bytes()
    assert whole.startswith(start)
    assert start.count(b"ITEM: TIMESTEP") == 11
    assert (slurry / "thermo.csv").read_text().startswith((tmp_path / "thermo.csv").read_text())
    for name in ("frame_1.restart", "frame_10.restart"):
        assert (tmp_path / name).read_bytes() == (slurry / name).read_bytes()
    run = json.loads((tmp_path / "run.json").read_text())
    assert (run["steps"], run["frames_written"]) == (500, 11)


def test_restart_frame_after_the_last_frame_is_refused(slurry, tmp_path, dem_command):
    command = [*dem_command(slurry, tmp_path, 10), "--restart-frames", "4", "11"]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 2
    assert result.stderr.endswith("--restart-frames 11: must be from 1 to --last-frame 10\n")


def wait_until(reached: Callable[[], object], process: subprocess.Popen) -> None:
    """Wait until something is reached while a process runs."""
    while not reached():
        assert process.poll() is None, "ended too early"
        time.sleep(0.002)


def killed(command: list[str], milestone: Path, everything: bool) -> None:
    """Run `command` until `milestone` exists, then kill the script, or it and all that it started, with SIGKILL."""
    with subprocess.Popen(command, start_new_session=True, stdout=subprocess.DEVNULL) as process:
        wait_until(milestone.exists, process)
        (os.killpg if everything else os.kill)(process.pid, signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL


@pytest.mark.parametrize("everything", [False, True], ids=["script", "everything"])
def test_killed_run_goes_on_and_ends_with_the_same_numbers(slurry, tmp_path, dem_command, everything):
    """With the script alone killed, its LAMMPS lives on for a moment, beside the one that the next start begins."""
    command = dem_command(slurry, tmp_path, 120)
    killed(command, tmp_path / "work" / "step_500.restart", everything)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["attempts", "work"]
    result = subprocess.run(command, check=True, capture_output=True, text=True)
    assert "goes on from step" in result.stdout
    assert_same_results(tmp_path, slurry)
    run, cost = (json.loads((tmp_path / name).read_text()) for name in ("run.json", "run_cost.json"))
    for clock in ("wall_s", "cpu_s"):  # of both attempts
        assert cost[clock] > run["start"][clock] + sum(segment[clock] for segment in run["segments"])
    first, second = (tmp_path / "attempts" / f"attempt_{n}.log" for n in (1, 2))
    assert "done: " in second.read_text() and "done: " not in first.read_text()
    assert all(
        re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d on \S+, pid \d+\n", log.read_text()) for log in (first, second)
    )


@pytest.fixture(scope="module")
def cut_off(slurry, tmp_path_factory, dem_command) -> Path:
    """Folder of a run that was killed after four of its six segments."""
    folder = tmp_path_factory.mktemp("cut off")
    killed(dem_command(slurry, folder, 120), folder / "work" / "segment_3000.json", everything=True)
    return folder


def replace(path: Path) -> None:
    shutil.copyfile(path.with_name("step_500.restart"), path)


@pytest.mark.parametrize(
    ("damage", "name", "last_good"),
    [
        (truncate, "step_3000.restart", 2000),
        pytest.param(flip, "step_3000.restart", 2000, marks=REPEATED),
        (replace, "step_3000.restart", 2000),
        (Path.unlink, "step_2000.restart", 500),
        pytest.param(truncate, "frames_500.dump", 50, marks=REPEATED),
        pytest.param(flip, "segment_3000.log", 2000, marks=REPEATED),
        pytest.param(truncate, "segment_2000.json", 500, marks=REPEATED),
        (flip, "step_0.restart", 0),
    ],
)
def test_damaged_segments_are_named_and_done_again(cut_off, slurry, tmp_path, dem_command, damage, name, last_good):
    shutil.copytree(cut_off, tmp_path, dirs_exist_ok=True)
    damage(tmp_path / "work" / name)
    result = subprocess.run(dem_command(slurry, tmp_path, 120), check=True, capture_output=True, text=True)
    assert f"{tmp_path / 'work' / name}: " in result.stdout
    assert "is done again" in result.stdout
    assert f"goes on from step {last_good} of 6000" in result.stdout or not last_good
    assert_same_results(tmp_path, slurry)


def test_finished_run_whose_outputs_are_gone_is_not_run_again(slurry, tmp_path, dem_command):
    """As after the kill of a workflow that had not taken note of the outputs yet, which it then deletes.

    By then a surrogate may have been left out of the configuration, and with it a restart frame.
    """
    command = dem_command(slurry, tmp_path, 10)
    subprocess.run(command, check=True)
    written = (tmp_path / "dump.lammpstrj").read_bytes()
    for name in ("dump.lammpstrj", "frame_10.restart", "run.json"):
        (tmp_path / name).unlink()
    fewer = dem_command(slurry, tmp_path, 10, restart_frames=[10])
    subprocess.run([*fewer, "--executable", "false"], check=True)
    assert (tmp_path / "dump.lammpstrj").read_bytes() == written
    assert (tmp_path / "run.json").exists()


def test_run_stops_between_segments_when_its_budget_is_used_up(slurry, tmp_path, dem_command):
    command = [*dem_command(slurry, tmp_path, 120), "--budget-min", "0.001"]
    for step in (50, 500, 2000):
        result = subprocess.run(command, capture_output=True, text=True)
        assert result.returncode == 75
        assert re.fullmatch(
            rf"\[A\] stopped at step {step}: the next segment takes about \d+ s, and \d+ of 0 s are gone: "
            r"the same command goes on\n",
            result.stderr,
        )
        assert not (tmp_path / "dump.lammpstrj").exists()
    subprocess.run(command[:-2], check=True)
    assert_same_results(tmp_path, slurry)


@pytest.mark.parametrize("number", [signal.SIGUSR1, signal.SIGTERM])
def test_signal_of_a_scheduler_lets_the_segment_end(slurry, tmp_path, dem_command, number):
    """Sent to LAMMPS too, as by Slurm; here the segment takes well below the time that is left after SIGTERM."""
    command = dem_command(slurry, tmp_path, 120)
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    log = tmp_path / "work" / "segment_2000.log"
    wait_until(lambda: log.exists() and "Step " in log.read_text() and log.read_text().count("\n      ") > 2, process)
    lammps = psutil.Process(process.pid).children()
    process.send_signal(number)
    if number == signal.SIGTERM:
        for child in lammps:
            child.send_signal(number)
    assert process.wait(timeout=30) == 75
    assert re.fullmatch(
        rf"\[A\] stopped at step \d+ by {number.name}: the same command goes on\n", process.stderr.read()
    )
    assert (tmp_path / "work" / "segment_2000.json").exists()
    subprocess.run(command, check=True)
    assert_same_results(tmp_path, slurry)


def test_second_run_on_the_same_folder_waits_for_the_first(slurry, tmp_path, dem_command):
    command = dem_command(slurry, tmp_path, 120)
    first = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    wait_until((tmp_path / "work" / "segment_50.json").exists, first)
    second = subprocess.run(command, check=True, capture_output=True, text=True)
    assert first.wait() == 0
    assert re.search(rf"work: in use by \S+ \(pid {first.pid}\)", second.stdout)
    assert_same_results(tmp_path, slurry)


def test_segment_killed_after_its_restart_file_and_before_the_end_of_its_log_is_run_again(
    slurry, tmp_path, dem_command
):
    command = dem_command(slurry, tmp_path, 120)
    work = tmp_path / "work"
    killed(command, work / "step_2000.restart", everything=True)
    log = work / "segment_2000.log"
    log.write_text(log.read_text().partition("Loop time")[0])
    (work / "segment_2000.json").unlink(missing_ok=True)
    subprocess.run(command, check=True)
    assert_same_results(tmp_path, slurry)


def test_failed_run_says_so_on_one_line_and_keeps_its_log(slurry, tmp_path, command, dem_command):
    inputs = tmp_path / "inputs"
    inputs.mkdir()
    for name in ("initial.data", "coefficients.lmp", "push_off.lmp", "inputs.json"):
        shutil.copyfile(slurry / name, inputs / name)
    (inputs / "coefficients.lmp").write_text("pair_coeff 1 1 no_such_style 1.0\n")
    outputs = tmp_path / "outputs"
    result = subprocess.run(dem_command(inputs, outputs, 10), capture_output=True, text=True)
    assert result.returncode == 1
    assert result.stderr.startswith("error: LAMMPS: ERROR: ")
    assert result.stderr.endswith(f"; log: {outputs / 'work' / 'start.log'}\n")
    assert result.stderr.count("\n") == 1
    assert (outputs / "work" / "start.log").exists()
    assert sorted(path.name for path in outputs.iterdir()) == ["attempts", "work"]


def test_terminated_run_takes_its_lammps_along(slurry, tmp_path, dem_command):
    process = subprocess.Popen(dem_command(slurry, tmp_path, 120), stdout=subprocess.DEVNULL)
    lammps: list[psutil.Process] = []

    def amid_a_segment() -> bool:
        lammps[:] = psutil.Process(process.pid).children()  # none between two segments
        return bool(lammps) and (tmp_path / "work" / "step_500.restart").exists()

    wait_until(amid_a_segment, process)
    process.terminate()
    assert process.wait(timeout=10) == 75
    assert psutil.wait_procs(lammps, timeout=5)[1] == []
