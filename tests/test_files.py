"""Outputs that appear whole or not at all, and errors on one line."""

import pytest

from slurrycast.files import InputError, RunError, moved_into_place, run_main, write_text


def test_output_appears_at_the_end_and_whole(tmp_path):
    place = tmp_path / "new folder" / "table.csv"
    with moved_into_place(place) as part:
        part.write_text("half")
        assert not place.exists()
        assert part.parent == place.parent  # a move within a file system is atomic, across two it is not
        assert part.suffix == ".csv"
        part.write_text("whole")
    assert place.read_text() == "whole"
    assert [path.name for path in place.parent.iterdir()] == ["table.csv"]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_earlier_output_survives_a_failure(tmp_path, error):
    place = tmp_path / "table.csv"
    place.write_text("earlier")
    with pytest.raises(error), moved_into_place(place) as part:
        part.write_text("half")
        raise error
    assert place.read_text() == "earlier"
    assert [path.name for path in tmp_path.iterdir()] == ["table.csv"]


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


@pytest.mark.parametrize("error", [InputError, RunError])
def test_bad_input_and_failed_runs_end_with_one_line(error):
    def main():
        raise error("a.h5: frame 9 is not in the file")

    with pytest.raises(SystemExit) as exit_:
        run_main(main)
    assert exit_.value.code == "error: a.h5: frame 9 is not in the file"  # a text as code: printed, exit code 1


def test_other_errors_keep_their_traceback():
    def main():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run_main(main)
