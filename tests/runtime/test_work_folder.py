"""Work folders: one process at a time, nothing of another job, parts whose damage is noticed, a log of each attempt."""

import json
import os
import shutil
import subprocess
import sys
import time

import pytest

from slurrycast.runtime import work_folder as module
from slurrycast.runtime.files import RunError
from slurrycast.runtime.work_folder import attempt_log, work_folder

# Locks the folder, starts a child that inherits the lock, says so, and sleeps.
HOLDER = """
import subprocess, sys, time
from pathlib import Path
from slurrycast.runtime.work_folder import work_folder
with work_folder(Path(sys.argv[1]), "a"):
    child = subprocess.Popen(["sleep", "60"], close_fds=False)
    print(child.pid, flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    """A process that holds the lock of tmp_path/work, and the pid of its child."""
    command = [sys.executable, "-c", HOLDER, str(tmp_path / "work")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        child = int(process.stdout.readline())
        yield process, child
        process.kill()
        subprocess.run(["kill", "-9", str(child)], stderr=subprocess.DEVNULL)


def test_parts_are_known_to_the_next_attempt(tmp_path, capsys):
    with work_folder(tmp_path / "work", "a") as work:
        (work.path / "x.dump").write_text("x")
        work.record("x", ["x.dump"], {"wall_s": 2.0, "cpu_s": 1.5})
        assert not work.finished("y")
    with work_folder(tmp_path / "work", "a") as work:
        assert work.finished("x")
        assert work.cost("x") == {"wall_s": 2.0, "cpu_s": 1.5}
        record = work.path / "x.json"
        record.write_text(record.read_text().replace("2.0", "3.0"))
        assert not work.finished("x")
    assert capsys.readouterr().out == f"{record}: damaged: x is done again\n"
    with work_folder(tmp_path / "work", "a") as work:
        work.forget("x")
        assert not work.finished("x")
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("content", [None, "", "y", "xx"])
def test_damage_is_noticed(tmp_path, capsys, content):
    with work_folder(tmp_path / "work", "a") as work:
        file = work.path / "x.dump"
        file.write_text("x")
        work.record("x", [file.name], {"wall_s": 2.0, "cpu_s": 1.5})
        if content is None:
            file.unlink()
        else:
            file.write_text(content)
        assert not work.finished("x")
    assert capsys.readouterr().out == f"{file}: truncated, or not what x left: x is done again\n"


@pytest.mark.parametrize("record", ["", "[1]", "null", '{"files": 3}', "{", '{"wall_s": 1}'])
def test_unreadable_record_is_no_record(tmp_path, capsys, record):
    with work_folder(tmp_path / "work", "a") as work:
        (work.path / "x.json").write_text(record)
        assert not work.finished("x")
    assert f"{tmp_path / 'work' / 'x.json'}: damaged: x is done again" in capsys.readouterr().out


@pytest.mark.parametrize(("identity", "left"), [("a", ["folder", "x"]), ("b", []), (None, [])])
def test_folder_of_another_job_is_emptied(tmp_path, capsys, identity, left):
    with work_folder(tmp_path / "work", "a") as work:
        (work.path / "x").touch()
        (work.path / "folder").mkdir()
    with work_folder(tmp_path / "work", identity) as work:
        assert sorted(path.name for path in work.path.iterdir() if path.name in ("x", "folder")) == left
    assert ("left by a run with other inputs" in capsys.readouterr().out) == (identity == "b")
    assert (tmp_path / "work").exists() == (identity is not None)


def test_folder_without_identity_is_kept_after_a_failure(tmp_path):
    with pytest.raises(ZeroDivisionError), work_folder(tmp_path / "work") as work:
        (work.path / "log").touch()
        raise ZeroDivisionError
    assert (tmp_path / "work" / "log").exists()


def test_live_lock_is_refused_with_the_pids_and_nothing_is_changed(holder, tmp_path, monkeypatch):
    process, child = holder
    before = sorted(path.name for path in (tmp_path / "work").iterdir())
    monkeypatch.setattr(module, "LOCK_WAIT_S", 0.3)
    with pytest.raises(RunError) as error, work_folder(tmp_path / "work", "b"):
        pass
    message = str(error.value)
    assert message.startswith(f"{tmp_path / 'work'}: in use by ")
    assert f"(pid {process.pid})" in message and f"sleep (pid {child})" in message
    assert message.endswith(": wait until it has ended or end it; nothing was changed")
    assert sorted(path.name for path in (tmp_path / "work").iterdir()) == before


def test_child_of_a_killed_process_holds_the_lock_until_it_ends(holder, tmp_path, monkeypatch, capsys):
    process, child = holder
    process.kill()
    process.wait()
    monkeypatch.setattr(module, "LOCK_WAIT_S", 0.3)
    with pytest.raises(RunError, match=rf"in use by sleep \(pid {child}\): wait"), work_folder(tmp_path / "work", "a"):
        pass
    monkeypatch.setattr(module, "LOCK_WAIT_S", 30.0)
    subprocess.Popen(["sh", "-c", f"sleep 0.5; kill {child}"])
    start = time.monotonic()
    with work_folder(tmp_path / "work", "a"):
        assert time.monotonic() - start > 0.3
    assert f"in use by sleep (pid {child}); waiting up to 30 s" in capsys.readouterr().out


def test_stale_lock_is_taken(tmp_path):
    (tmp_path / "work").mkdir()
    (tmp_path / "work" / "lock").write_text(json.dumps({"pid": 1, "host": "a node that is gone"}))
    with work_folder(tmp_path / "work", "a"):
        assert json.loads((tmp_path / "work" / "lock").read_text())["pid"] == os.getpid()


def test_holder_on_another_machine_is_what_the_lock_says(tmp_path):
    lock = tmp_path / "lock"
    lock.write_text(json.dumps({"pid": 12, "host": "node7"}))
    assert module._holder(lock) == "a process of node7 (started by pid 12 there)"
    lock.write_text("")
    assert module._holder(lock) == "another process"


def test_lock_of_a_folder_that_was_removed_meanwhile_does_not_count(tmp_path, monkeypatch):
    """The holder removes its folder at the end: who waited locked a file that is not there any more."""
    flock, work = module.fcntl.flock, tmp_path / "work"
    removed = []

    def after_removal(descriptor, how):
        if not removed:
            removed.append(True)
            shutil.rmtree(work)
        flock(descriptor, how)

    monkeypatch.setattr(module.fcntl, "flock", after_removal)
    with work_folder(work, "a"):
        assert (work / "lock").exists()


def test_each_attempt_has_a_log_of_its_own(tmp_path, capsys):
    for word in ("one", "two"):
        with attempt_log(tmp_path / "logs") as log:
            print(word)
        assert log.read_text().splitlines()[1:] == [word]
    with pytest.raises(RunError), attempt_log(tmp_path / "logs"):
        raise RunError("LAMMPS: no")
    (tmp_path / "logs" / "attempt_3_found_segment_50.log").touch()
    with attempt_log(tmp_path / "logs") as log:
        assert log.name == "attempt_4.log"
    assert (tmp_path / "logs" / "attempt_3.log").read_text().splitlines()[1:] == ["RunError: LAMMPS: no"]
    assert capsys.readouterr().out == "one\ntwo\n"


def test_attempt_goes_on_when_the_reader_of_its_output_is_gone(tmp_path):
    """A scheduler's signal ends `tee` too."""
    code = """
import pathlib, sys, time
from slurrycast.runtime.work_folder import attempt_log
with attempt_log(pathlib.Path(sys.argv[1])):
    for k in range(3):
        print(f"line {k}", flush=True)
        time.sleep(0.2)
"""
    command = [sys.executable, "-c", code, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        process.stdout.readline()
        process.stdout.close()
    assert (tmp_path / "attempt_1.log").read_text().splitlines()[1:] == ["line 0", "line 1", "line 2"]
