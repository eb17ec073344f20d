"""The workflow through profiles/slurm on a real Slurm: MPI, a job cut by its walltime, one that is cancelled."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pandas as pd
import pytest

from checkouts import copy_checkout
from cluster import missing, processes_of, running_slurm

HERE = Path(__file__).parent
SCALE = ("config/tiny.yaml", "config/few.yaml")
COUNTED = ("cost.csv", "speedup.csv")  # of clocks, and what derives from them
PLUGIN = "snakemake_executor_plugin_slurm"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(missing()), reason=f"no Slurm: {missing()}"),
    pytest.mark.skipif(
        importlib.util.find_spec(PLUGIN) is None,
        reason=f"no Slurm: {PLUGIN} is not in this environment: make test-slurm",
    ),
]


def checkout(folder: Path) -> Path:
    """A copy of what the workflow consists of, with the configurations of these tests."""
    copy_checkout(folder)
    names = (
        "few.yaml",
        "few.tsv",
        "disturbed.yaml",
        "two_ranks.yaml",
        "two_ranks.tsv",
        "lmp_that_hangs",
        "explored.yaml",
    )
    for name in names:
        shutil.copy(HERE / name, folder / "config")
    return folder


def snakemake(project: Path, environment: dict[str, str], *arguments: str) -> subprocess.Popen:
    """Start Snakemake in `project`; what it prints goes to snakemake.log there."""
    with (project / "snakemake.log").open("w") as log:
        command = [Path(sys.executable).with_name("snakemake"), *arguments]
        return subprocess.Popen(command, cwd=project, env=environment, stdout=log, stderr=subprocess.STDOUT)


def submitted(*configurations: str, scale: tuple[str, ...] = SCALE) -> list[str]:
    """Arguments with which Snakemake submits jobs; status checks are for short jobs and no accounting."""
    options = {"status-command": "squeue", "init-seconds-before-status-checks": "1"}
    settings = [word for name, value in options.items() for word in (f"--slurm-{name}", value)]
    settings += ["--slurm-keep-successful-logs", "--workflow-profile", "profiles/slurm"]
    return [*settings, "--configfile", *scale, *configurations]


def wait_for(condition: Callable[[], object], run: subprocess.Popen, seconds: float, what: str) -> None:
    """Return when the condition holds; fail if the run fails before, or after `seconds`."""
    end = time.monotonic() + seconds
    while not condition():
        assert not run.poll(), f"exit code {run.returncode} before {what}"
        assert time.monotonic() < end, f"no {what} within {seconds:.0f} s"
        time.sleep(0.2)


def job_of(environment: dict[str, str], comment: str) -> str:
    """Slurm's id of the running job with this comment."""
    command = ["squeue", "--noheader", "--states=running", "--format=%i %k"]
    listed = subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout
    return next(line.split()[0] for line in listed.splitlines() if line.split()[1] == comment)


@pytest.fixture(scope="module")
def slurm(tmp_path_factory) -> Iterator[dict[str, str]]:
    with running_slurm(tmp_path_factory.mktemp("slurm") / "node") as environment:
        yield environment


@pytest.fixture(scope="module")
def projects(slurm, tmp_path_factory) -> dict[str, Path]:
    """Three checkouts: disturbed on Slurm, undisturbed on this machine, and on Slurm with two ranks."""
    names = ("disturbed", "local", "two_ranks")
    folders = {name: checkout(tmp_path_factory.mktemp("checkouts") / name) for name in names}
    runs = [snakemake(folders["disturbed"], slurm, *submitted("config/disturbed.yaml"))]
    try:
        dem = folders["disturbed"] / "results" / "few" / "dem"
        hung = [dem / slurry / "work" / "hung" for slurry in ("T1", "T2")]
        wait_for(lambda: all(map(Path.is_dir, hung)), runs[0], 120, "DEM that hangs")
        subprocess.run(["scancel", job_of(slurm, "rule_run_slurry_wildcards_T2")], env=slurm, check=True)
        # meanwhile T1 waits for the end of its walltime
        target = "results/two_ranks/frames/1.h5"
        runs.append(snakemake(folders["two_ranks"], slurm, *submitted("config/two_ranks.yaml"), "--", target))
        assert runs[-1].wait(240) == 0, (folders["two_ranks"] / "snakemake.log").read_text()[-5000:]
        runs.append(snakemake(folders["local"], dict(os.environ), "--cores", "1", "--configfile", *SCALE))
        assert runs[-1].wait(240) == 0, (folders["local"] / "snakemake.log").read_text()[-5000:]
        assert runs[0].wait(400) == 0, (folders["disturbed"] / "snakemake.log").read_text()[-5000:]
    finally:
        for run in runs:
            if run.poll() is None:
                run.kill()
                run.wait()
    return folders


def attempts(project: Path, slurry: str) -> list[str]:
    """What each attempt at the DEM of a slurry printed."""
    folder = project / "results" / "few" / "logs" / "run_slurry" / slurry
    return [log.read_text(encoding="utf-8") for log in sorted(folder.glob("attempt_*.log"))]


def slurm_logs(project: Path, rule: str) -> list[str]:
    """What Slurm kept of the jobs of a rule and its wildcards, in the order of submission."""
    logs = sorted((project / ".snakemake" / "slurm_logs" / rule).rglob("*.log"), key=lambda log: int(log.stem))
    return [log.read_text(encoding="utf-8", errors="replace") for log in logs]


def test_tables_are_those_of_a_local_run(projects):
    tables = {name: projects[name] / "results" / "few" / "tables" for name in ("disturbed", "local")}
    names = sorted(table.name for table in tables["local"].glob("*.csv"))
    assert names == sorted(table.name for table in tables["disturbed"].glob("*.csv"))
    compared = [name for name in names if name not in COUNTED]
    assert len(compared) == 9
    for name in compared:
        assert (tables["disturbed"] / name).read_bytes() == (tables["local"] / name).read_bytes(), name


@pytest.mark.parametrize("slurry", ["T1", "T2"])
def test_what_was_cut_off_goes_on_from_its_last_segment(projects, slurry):
    first, second = attempts(projects["disturbed"], slurry)
    assert "done" not in first
    assert f"[{slurry}] goes on from step 6000 of 24000" in second
    assert f"[{slurry}] done" in second
    assert len(attempts(projects["disturbed"], "1")) == 1


def test_one_job_met_its_walltime_and_one_was_cancelled(projects):
    met = {slurry: slurm_logs(projects["disturbed"], f"rule_run_slurry/{slurry}") for slurry in ("T1", "T2")}
    assert {slurry: len(logs) for slurry, logs in met.items()} == {"T1": 2, "T2": 2}
    assert "DUE TO TIME LIMIT" in met["T1"][0]
    assert re.search(r"JOB \d+ ON \S+ CANCELLED AT", met["T2"][0])
    assert "TIME LIMIT" not in met["T2"][0]


def test_short_jobs_share_one(projects):
    assert len(slurm_logs(projects["disturbed"], "group_predictions_predict_slurry")) == 1
    assert len(slurm_logs(projects["disturbed"], "group_structures_compute_rdf")) == 1
    assert slurm_logs(projects["disturbed"], "rule_extract_frames") == []


def test_on_a_cluster_the_budget_of_a_dem_is_its_walltime(projects):
    (log,) = slurm_logs(projects["two_ranks"], "rule_run_slurry/1")
    (minutes,) = set(re.findall(r"--budget-min \$\(\((\d+) \* 1\)\)", log))
    assert set(re.findall(r"runtime=(\d+)", log)) == {minutes}


def test_two_ranks(projects):
    """Up to the last input frame, two ranks are at most a hundredth as far from one as another seed is."""
    folder = projects["two_ranks"] / "results" / "two_ranks" / "dem" / "1"
    assert json.loads((folder / "run.json").read_text())["ranks"] == 2
    two = pd.read_csv(folder / "thermo.csv").set_index("step")
    assert two.index[-1] == 2000
    local = projects["local"] / "results" / "few" / "dem"
    one, other_seed = (pd.read_csv(local / slurry / "thermo.csv").set_index("step").loc[2000] for slurry in ("1", "T1"))
    difference, band = (abs(two.loc[2000] - one), abs(other_seed - one))
    assert difference.density_g_cm3 < band.density_g_cm3 / 100


def test_an_exploration_is_that_of_a_local_run(slurm, tmp_path):
    """Each recipe as jobs of Slurm; the design is written beside them."""
    scale = ("config/tiny.yaml", "config/explored.yaml")
    ways = {
        "local": (dict(os.environ), ["--cores", "2", "--configfile", *scale]),
        "slurm": (slurm, submitted(scale=scale)),
    }
    for name, (environment, arguments) in ways.items():
        project = checkout(tmp_path / name)
        for target in ("design", "explore"):
            run = snakemake(project, environment, target, *arguments)
            assert run.wait(300) == 0, (project / "snakemake.log").read_text()[-5000:]
    assert len(slurm_logs(tmp_path / "slurm", "rule_dry_slurry")) == 6
    for table in ("explore", "explore_noise", "explore_nearest"):
        made = [tmp_path / name / "results" / "explored" / "tables" / f"{table}.csv" for name in ways]
        assert made[0].read_bytes() == made[1].read_bytes()


def test_nothing_is_left_of_a_slurm(tmp_path):
    """Neither a daemon nor a job that does not hear SIGTERM, though the block ended with an error."""
    folder = tmp_path / "node"

    def fail() -> None:
        with running_slurm(folder) as environment:
            daemons = len(processes_of(folder))
            script = "trap '' TERM; touch begun; sleep 999 & sleep 999"
            job = ["sbatch", "--output", tmp_path / "log", "--wrap", script]
            submitted = subprocess.Popen(job, cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL)
            wait_for((tmp_path / "begun").exists, submitted, 60, "start of the job")
            assert len(processes_of(folder)) > daemons >= 3
            raise RuntimeError("on purpose")

    with pytest.raises(RuntimeError, match="on purpose"):
        fail()
    assert processes_of(folder) == []
