"""A short fault campaign, and whether a campaign would notice a loss."""

import csv
import json
import os
import random
import re
import resource
import subprocess
import sys
from collections import Counter
from pathlib import Path

import h5py
import numpy as np
import pytest
import yaml

import campaign
from checkouts import snakemake
from comparison import differences
from corruption import damage
from folders import own_disk
from kills import STAGE_OF, STAGES, VICTIMS, planned
from project import Injection
from slurrycast.runtime.files import moved_into_place, write_text

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "results" / "reference" / "torture" / "campaign.csv"
STEPS = [0, 50, 100, 150]
SHORT = {  # surrogates that a short training is enough for
    "surrogate": {"names": ["affine", "vgg16_box"], "vgg16_box": {"epochs": 1, "batch_size": 32}},
    "evaluation": {"surrogates": ["early_dem_x2"]},
}
SHORT_TABLE = "id\trole\tmass_units\tthickness_ratio\tseed\nT1\ttrain\t1\t1.0\t1101\n1\ttest\t1\t1.0\t2101\n"


def write_frames_of(results: Path, steps: list[int]) -> None:
    with moved_into_place(results / "frames" / "T1.h5") as part, h5py.File(part, "w") as file:
        file["particles/slurry/position/step"] = steps
        file["particles/slurry/position/value"] = np.arange(len(steps), dtype=float)


@pytest.fixture
def two(tmp_path) -> tuple[Path, Path]:
    """A reference and results that hold the same; frames, a table, costs, a run."""
    dem = {"steps": 150, "frames": 4}
    for name, seconds in (("reference", 1.0), ("results", 2.0)):
        folder = tmp_path / name
        write_frames_of(folder, STEPS)
        write_text(folder / "tables" / "density_volume.csv", "slurry,density_g_cm3\nT1,2.2\n")
        write_text(folder / "tables" / "cost.csv", f"stage,wall_s\nrun_slurry,{seconds}\n")
        segments = [{"step_start": 0, "step_end": 150, "wall_s": seconds}]
        run = {"physics": {"dem": dem}, "frames_written": 4, "start": {"wall_s": seconds}, "segments": segments}
        write_text(folder / "dem" / "T1" / "run.json", json.dumps(run))
    return tmp_path / "reference", tmp_path / "results"


def test_seconds_are_no_difference(two):
    assert differences(*two) == []


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda folder: write_text(folder / "tables/density_volume.csv", "T1,2.3\n"), "density_volume.csv: differs"),
        (lambda folder: (folder / "tables/cost.csv").unlink(), "tables/cost.csv: missing"),
        (lambda folder: (folder / "tables/cost.csv").write_text("half"), "tables/cost.csv: damaged"),
        (lambda folder: (folder / "tables/.cost.vm-1.part.csv").write_text("half"), "part.csv: left behind"),
        (lambda folder: write_text(folder / "dem/T1/work/segment_50.json", "{}"), "segment_50.json: left behind"),
        (lambda folder: write_frames_of(folder, STEPS[:-1]), "T1.h5: 3 frames of 4, 1 missing, 0 doubled"),
        (lambda folder: write_frames_of(folder, [0, 50, 50, 100]), "T1.h5: 4 frames of 4, 1 missing, 1 doubled"),
    ],
)
def test_a_difference_is_noticed(two, change, said):
    reference, results = two
    change(results)
    assert said in "\n".join(differences(reference, results))


def test_frames_are_compared_by_content(two):
    reference, results = two
    with h5py.File(results / "frames" / "T1.h5", "r+") as file:
        file["particles/slurry/position/value"][1] += 1e-15
    (results / "frames" / ".checksums" / "T1.h5.sha256").unlink()
    assert differences(reference, results) == ["frames/T1.h5: differs"]


@pytest.mark.parametrize("way", ["cut", "flipped bit"])
def test_damage(tmp_path, way):
    path, sound = tmp_path / "file", bytes(range(50))
    for seed in range(20):
        path.write_bytes(sound)
        before = path.stat().st_mtime_ns
        damage(path, way, random.Random(seed))
        bad = path.read_bytes()
        assert path.stat().st_mtime_ns == before
        if way == "cut":
            assert sound.startswith(bad)
            assert len(bad) < len(sound)
        else:
            assert sum((a ^ b).bit_count() for a, b in zip(sound, bad, strict=True)) == 1


def test_plan_has_every_victim_in_every_stage():
    plan = planned(3, 30, STAGES)
    found = {(kill.stage, kill.victim) for kill in plan}
    assert len(found) == 30
    assert {stage for stage, victim in found if victim == "LAMMPS"} == {"DEM", "relaxation", "tape"}
    assert {victim for _, victim in found} == set(VICTIMS)
    assert plan == planned(3, 30, STAGES) != planned(4, 30, STAGES)


def test_every_job_of_the_main_job_may_be_killed():
    """But the targets, which only wait, and those that a campaign is not about."""
    said = snakemake(ROOT, "--dry-run", "--forceall", "--configfile", "config/tiny.yaml")
    assert set(re.findall(r"^(?:local)?rule (\w+):", said, re.MULTILINE)) - {"all"} == set(STAGE_OF) - {"adopt_model"}


@pytest.mark.parametrize(("lost", "code"), [("", 0), ("tables/skill.csv: missing", 1)])
def test_a_loss_is_an_exit_code(monkeypatch, tmp_path, capsys, lost, code):
    injection = Injection("kill", "DEM", "LAMMPS", "1.00 s into the stage", "the job failed", lost)
    monkeypatch.setattr(campaign, "campaign", lambda args, folder: iter([injection]))
    monkeypatch.setattr(sys, "argv", ["campaign.py", "--table", str(tmp_path / "t.csv")])
    with pytest.raises(SystemExit) as ended:
        campaign.main()
    assert ended.value.code == code
    assert (lost in capsys.readouterr().out) or not lost
    assert [row["lost"] for row in csv.DictReader((tmp_path / "t.csv").open())] == [lost]


def test_hdf5_on_a_full_disk(slurry, tmp_path, command):
    """A limit on the size of files, which no rights are needed for, in place of a full disk."""
    words = command(
        "extract_frames",
        dump=slurry / "dump.lammpstrj",
        inputs=slurry / "inputs.json",
        run=slurry / "run.json",
        frames=tmp_path / "frames.h5",
        cost=tmp_path / "cost.json",
    )
    limit = (slurry / "frames.h5").stat().st_size // 2
    run = subprocess.run(
        words, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)), capture_output=True
    )
    assert run.returncode == 1
    said = f"error: {tmp_path / 'frames.h5'}: File too large; what was finished before is kept\n"
    assert run.stderr.decode() == said
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_a_disk_of_its_own_leaves_the_folder_as_it_was(tmp_path):
    folder = tmp_path / "results"
    write_text(folder / "a.txt", "a")
    with own_disk(folder) as mounted:
        assert os.path.ismount(folder) == mounted
        if mounted:
            (folder / "a.txt").write_text("b")
    assert not os.path.ismount(folder)
    assert (folder / "a.txt").read_text() == "a"


@pytest.mark.slow
@pytest.mark.full
def test_short_campaign(tmp_path):
    """Damaged files, and three kills: LAMMPS in the DEM, Snakemake in the prediction, the driver of a relaxation."""
    (tmp_path / "slurries.tsv").write_text(SHORT_TABLE)
    (tmp_path / "short.yaml").write_text(yaml.safe_dump({"slurries": str(tmp_path / "slurries.tsv")} | SHORT))
    table = tmp_path / "table.csv"
    command = [sys.executable, Path(campaign.__file__), "--overlay", tmp_path / "short.yaml", "--target", "tables"]
    command += ["--kills", "3", "--seed", "68", "--files", "12", "--no-evaluation", "--no-folders", "--table", table]
    run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert run.returncode == 0, run.stdout
    kinds = Counter(row["kind"] for row in csv.DictReader(table.open()))
    assert kinds == {"kill": 3, "damaged file": 12}


def test_reference_campaign():
    """The last full campaign lost nothing, and killed what docs/reliability.md says. The tape is newer."""
    rows = list(csv.DictReader(REFERENCE.open()))
    assert not [row for row in rows if row["lost"]]
    hit = Counter((row["stage"], row["target"]) for row in rows if row["kind"] == "kill")
    lammps = {(stage, "LAMMPS") for stage in ("DEM", "relaxation")}
    stages = STAGES.keys() - {"tape"}
    assert set(hit) == lammps | {(stage, victim) for stage in stages for victim in VICTIMS if victim != "LAMMPS"}
