"""What a stage costs: its own CPU time and that of its child processes, written only if it succeeded."""

import json
import subprocess
import sys
import time

import psutil
import pytest

from slurrycast.runtime.costs import measured_cost, read_cost

BUSY = "import time\nend = time.process_time() + 0.5\nwhile time.process_time() < end: pass"


@pytest.fixture
def record(tmp_path, root):
    """The record that a process of its own writes with some code as the measured block."""

    def measure(body: str) -> dict:
        head = ["from slurrycast.runtime.costs import measured_cost", "with measured_cost(sys.argv[1], 'stage'):"]
        program = "\n".join(["import subprocess, sys, time", *head, *(f"    {line}" for line in body.splitlines())])
        command = [sys.executable, "-c", program, str(tmp_path / "cost.json")]
        subprocess.run(command, check=True, cwd=root / "scripts")
        return json.loads((tmp_path / "cost.json").read_text())

    return measure


def test_cpu_of_child_processes_counts(record):
    idle = record("pass")
    busy = record(f"subprocess.run([sys.executable, '-c', {BUSY!r}])")
    assert 0.45 < busy["cpu_s"] - idle["cpu_s"] < 1.5
    assert busy["wall_s"] >= 0.5


def test_own_cpu_counts_and_sleep_does_not(record):
    idle = record("time.sleep(0.5)")
    busy = record(BUSY)
    assert idle["wall_s"] >= 0.5
    assert busy["cpu_s"] - idle["cpu_s"] > 0.3


def test_start_up_of_the_process_counts(tmp_path):
    started = time.time() - psutil.Process().create_time()
    with measured_cost(tmp_path / "cost.json", "stage"):
        pass
    assert read_cost(tmp_path / "cost.json").wall_s >= started


def test_peak_memory_is_that_of_the_largest_process(record):
    # A process starts with the peak of the one that started it, which may be that of all tests so far.
    idle = record("pass")["max_rss_mb"]
    child = record(f"subprocess.run([sys.executable, '-c', 'x = bytes(1) * {int(idle) + 200} * 2**20'])")
    assert child["max_rss_mb"] > idle + 150


def test_record_holds_what_the_stage_filled_in(tmp_path):
    with measured_cost(tmp_path / "cost.json", "run_slurry", "vgg16", "3") as cost:
        cost.particles, cost.steps = 600, 60000
        cost.wall_s = 1000.0  # of an earlier attempt
    cost = read_cost(tmp_path / "cost.json")
    assert (cost.stage, cost.surrogate, cost.slurry) == ("run_slurry", "vgg16", "3")
    assert (cost.particles, cost.steps) == (600, 60000)
    assert cost.wall_s > 1000


def test_nothing_is_written_when_the_stage_fails(tmp_path):
    with pytest.raises(RuntimeError, match="no"), measured_cost(tmp_path / "cost.json", "stage"):
        raise RuntimeError("no")
    assert not list(tmp_path.iterdir())
