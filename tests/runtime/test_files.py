"""Outputs that appear whole or not at all, and whose damage is noticed."""

import os
import shutil
import socket
import subprocess
from pathlib import Path

import pytest

from damage import flip
from slurrycast.runtime import files
from slurrycast.runtime.files import CHECKSUMS, InputError, check_unchanged, moved_into_place, write_text


def visible(folder: Path) -> list[str]:
    """What is in a folder beside the checksums."""
    return [path.name for path in folder.iterdir() if path.name != CHECKSUMS]


def test_output_appears_at_the_end_and_whole(tmp_path):
    place = tmp_path / "new folder" / "table.csv"
    with moved_into_place(place) as part:
        part.write_text("half")
        assert not place.exists()
        assert part.parent == place.parent  # a move within a file system is atomic, across two it is not
        assert part.suffix == ".csv"
        part.write_text("whole")
    assert place.read_text() == "whole"
    assert visible(place.parent) == ["table.csv"]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_earlier_output_survives_a_failure(tmp_path, error):
    place = tmp_path / "table.csv"
    place.write_text("earlier")
    with pytest.raises(error), moved_into_place(place) as part:
        part.write_text("half")
        raise error
    assert place.read_text() == "earlier"
    assert visible(tmp_path) == ["table.csv"]


def test_block_that_writes_nothing_is_an_error_and_leaves_the_earlier_output(tmp_path):
    place = tmp_path / "table.csv"
    place.write_text("earlier")
    with pytest.raises(FileNotFoundError), moved_into_place(place):
        pass
    assert place.read_text() == "earlier"


def test_reader_that_holds_the_earlier_output_open_goes_on_reading_it(tmp_path):
    place = tmp_path / "table.csv"
    place.write_text("earlier")
    with place.open() as reader:
        write_text(place, "new")
        assert reader.read() == "earlier"
    assert place.read_text() == "new"


def test_text_is_utf8(tmp_path):
    write_text(tmp_path / "a.txt", "µm³")
    assert (tmp_path / "a.txt").read_bytes() == "µm³".encode()


def test_checksum_is_that_of_sha256sum(tmp_path):
    write_text(tmp_path / "a table.csv", "µm³")
    check = ["sha256sum", "--check", f"{CHECKSUMS}/a table.csv.sha256"]
    assert subprocess.run(check, cwd=tmp_path, capture_output=True, text=True).stdout == "a table.csv: OK\n"


@pytest.mark.parametrize("damage", [flip, lambda path: path.write_text("µ"), lambda path: path.write_text("")])
def test_damage_is_refused_with_the_name(tmp_path, damage):
    place = tmp_path / "a.csv"
    write_text(place, "µm³")
    check_unchanged(place)
    damage(place)
    with pytest.raises(InputError) as error:
        check_unchanged(place)
    assert str(error.value) == (
        f"{place}: not what was written there, it is damaged or was edited (sha256 differs from "
        f"{tmp_path / CHECKSUMS / 'a.csv.sha256'}): delete it, and the workflow makes it anew"
    )
    write_text(place, "new")
    check_unchanged(place)


def test_file_of_unknown_origin_passes_and_a_missing_one_does_not(tmp_path):
    (tmp_path / "a.csv").touch()
    check_unchanged(tmp_path / "a.csv")
    for missing in (tmp_path / "b.csv", tmp_path):
        with pytest.raises(InputError, match=f"{missing}: no such file"):
            check_unchanged(missing)


def test_kill_between_file_and_checksum_leaves_neither_with_the_other_of_before(tmp_path, monkeypatch):
    place = tmp_path / "a.csv"
    write_text(place, "earlier")
    moves = []

    def killed(source, target):
        moves.append(target)
        if len(moves) == 2:
            raise KeyboardInterrupt
        shutil.move(source, target)

    monkeypatch.setattr(files.os, "replace", killed)
    with pytest.raises(KeyboardInterrupt):
        write_text(place, "new")
    assert place.read_text() == "new"
    check_unchanged(place)


def test_what_a_killed_process_left_half_written_is_removed_by_the_next(tmp_path):
    dead = subprocess.Popen(["true"])
    dead.wait()
    here = socket.gethostname()
    left = {pid: tmp_path / f".a[1].{here}-{pid}.part.csv" for pid in (dead.pid, os.getppid())}
    elsewhere = tmp_path / f".a[1].another-node-{dead.pid}.part.csv"
    for path in (*left.values(), elsewhere):
        path.write_text("half")
    write_text(tmp_path / "a[1].csv", "whole")
    assert sorted(visible(tmp_path)) == sorted(["a[1].csv", left[os.getppid()].name, elsewhere.name])
