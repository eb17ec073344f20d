"""Results that were copied, with new times or without the records of Snakemake: never deleted, taken over if whole."""

import json
import os
import shutil
from pathlib import Path

import pytest
import yaml

from checkouts import snakemake
from configurations import HEADER, ROOT, load
from slurrycast.runtime.files import checksum, write_text

pytestmark = pytest.mark.slow
RESULTS = Path("results/copied")
FRAMES = RESULTS / "frames/1.h5"


def run(folder: Path, *arguments: str, target: Path = FRAMES, fails: bool = False) -> str:
    """Ask for the frames of slurry 1, or another file, in the working directory `folder`."""
    options = ["--directory", str(folder), "--configfile", str(folder / "my.yaml"), *arguments]
    return snakemake(ROOT, *options, "--", str(target), fails=fails)


def contents(folder: Path) -> dict[str, str]:
    """Checksums of all results."""
    return {str(path): checksum(path) for path in (folder / RESULTS).rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A working directory with inputs of 15,700 particles, more than 1 MB, and files in place of a DEM of hours."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "my.tsv").write_text(f"{HEADER}1\ttest\t60\t1.0\t1\nT1\ttrain\t1\t1.0\t2\n")
    config = load("tiny") | {"run": {"name": "copied"}, "slurries": "my.tsv"}
    config["formulation"] = config["formulation"] | {"unit_mass_pg": 340.0}
    (folder / "my.yaml").write_text(yaml.safe_dump(config))
    dem = folder / RESULTS / "dem/1"
    options = ["--directory", str(folder), "--configfile", str(folder / "my.yaml")]
    targets = [str(RESULTS / "dem/1/inputs.json"), str(RESULTS / "config.yaml")]
    snakemake(ROOT, *options, "--", *targets)
    assert (dem / "initial.data").stat().st_size > 1e6
    inputs = json.loads((dem / "inputs.json").read_text())
    for name in ("frame_10.restart", "lammps.log", "thermo.csv"):
        write_text(dem / name, name)
    write_text(dem / "run.json", json.dumps({"frames_written": 121, "physics": inputs["physics"]}))
    write_text(folder / RESULTS / "costs/run_slurry/1.json", "{}")
    write_text(folder / RESULTS / "costs/extract_frames/1.json", "{}")
    write_text(folder / FRAMES, "frames")
    run(folder, "--touch", "--forceall")
    return folder


def copied(made: Path, name: str, age_s: float = 0.0, records: bool = True) -> Path:
    """Copy the working directory; results become older by `age_s`, and may come without the records of Snakemake."""
    folder = made.with_name(name)  # beside it: jobs name the files of the project from the working directory
    shutil.copytree(made, folder)
    for path in (folder / RESULTS).rglob("*"):
        os.utime(path, times=(path.stat().st_mtime - age_s,) * 2)
    if not records:
        shutil.rmtree(folder / ".snakemake")
    return folder


def test_new_times_of_large_files_repeat_nothing(made):
    folder = copied(made, "new_times")
    for name in ("initial.data", "inputs.json"):
        (folder / RESULTS / "dem/1" / name).touch()
    assert "Nothing to be done" in run(folder, "--dry-run")


def test_results_without_records_are_kept_and_can_be_taken_over(made):
    folder = copied(made, "no_records", age_s=1e6, records=False)
    before = contents(folder)
    said = run(folder, fails=True)
    assert f"{RESULTS}: run_slurry 1 and 2 more jobs would delete finished results and make them again" in said
    assert contents(folder) == before
    run(folder, "--touch", "--forceall")
    assert "Nothing to be done" in run(folder, "--dry-run")
    assert contents(folder) == before


def test_only_whole_results_of_this_configuration_are_taken_over(made):
    folder = copied(made, "damaged", age_s=1e6, records=False)
    with (folder / RESULTS / "dem/1/thermo.csv").open("a") as file:
        file.write("x")
    (folder / RESULTS / "dem/1/.checksums/lammps.log.sha256").unlink()
    write_text(folder / RESULTS / "dem/T1/dump.lammpstrj", "not extracted yet")
    config = yaml.safe_load((folder / "my.yaml").read_text())
    config["learning"] = config.get("learning", {}) | {"seed": 12345}
    (folder / "my.yaml").write_text(yaml.safe_dump(config))
    table = folder / "my.tsv"
    table.write_text(table.read_text().replace("T1\ttrain", "T2\ttrain"))
    said = run(folder, "--touch", "--forceall", fails=True)
    for line in (
        f"{RESULTS}/dem/1/thermo.csv: not what was written there",
        f"{RESULTS}/dem/1/lammps.log: no checksum in .checksums/ beside it",
        f"{RESULTS}: made with learning.seed = 20260101, the configuration has 12345: take them over with --configfile",
        f"{RESULTS}/slurries.tsv: the slurries that the results were made with are not those of my.tsv",
        f"{RESULTS}/dem/T1/dump.lammpstrj: would be deleted, and has no frames yet: add --notemp",
        "Nothing was touched",
    ):
        assert line in said


def test_results_that_do_not_say_how_they_were_made_are_not_taken_over(made):
    folder = copied(made, "unknown", age_s=1e6, records=False)
    (folder / RESULTS / "models").mkdir()
    recorded = folder / RESULTS / "config.yaml"
    recorded.write_text("run: [\n")
    (recorded.parent / ".checksums" / "config.yaml.sha256").unlink()
    assert f"{RESULTS}/config.yaml line 2: " in run(folder, "--touch", "--forceall", fails=True)
    recorded.unlink()
    assert f"{RESULTS}/config.yaml: no such file: without it" in run(folder, "--touch", "--forceall", fails=True)


@pytest.mark.parametrize("lost", [RESULTS / "dem/1/frame_10.restart", FRAMES])
def test_a_finished_dem_of_which_a_file_is_lost_is_not_repeated_unasked(made, lost):
    folder = copied(made, f"lost_{lost.stem}")
    (folder / lost).unlink()
    before = contents(folder)
    said = run(folder, target=lost, fails=True)
    assert f"{RESULTS}: run_slurry 1 would delete finished results" in said and "set run.overwrite: true" in said
    assert contents(folder) == before


def test_an_upstream_job_that_runs_again_does_not_delete_a_finished_dem(made):
    """As after an edit of the code: if the DEM should run again, run.overwrite says so."""
    folder = copied(made, "upstream")
    before = contents(folder)
    said = run(folder, "--forcerun", "generate_inputs", fails=True)
    assert f"{RESULTS}: run_slurry 1 would delete finished results" in said
    assert contents(folder) == before


def test_surrogate_that_starts_where_a_finished_dem_kept_no_restart_file_is_refused(made):
    folder = copied(made, "earlier_start")
    predicted = RESULTS / "hybrid/early_dem_x10_f02/1/predicted.h5"
    said = run(folder, target=predicted, fails=True)
    assert f"{RESULTS}/dem/1/frame_2.restart: no such file, early_dem_x10_f02 starts from it: leave" in said
    assert f"add --forcerun {RESULTS}/dem/1/run.json to run the DEM again" in said
    assert "frame_2" not in run(
        folder, "--forcerun", f"{RESULTS}/dem/1/run.json", "--until", "generate_inputs", target=predicted
    )
