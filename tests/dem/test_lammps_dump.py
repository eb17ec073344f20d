"""The dump reader: good files in full precision, and every kind of broken file refused with file, frame and line."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from damage import assert_names_its_file, variants
from slurrycast.dem.lammps_dump import COLUMNS, read_dump
from slurrycast.runtime.files import InputError

PARTICLES, LINES = 3, 12  # particles of the dumps below, lines of one of their frames


def frame_text(step: int, shift_um: float = 0.0) -> str:
    edge_um = 4.0 - step / 1000
    rows = [
        f"{number} {number % 2 + 1} {number / 7:.15g} "
        f"{number / 3 + shift_um:.15g} {-number / 3:.15g} {number / 9:.15g} "
        f"{number / 11:.15g} {number / 13:.15g} {number / 17 - 1:.15g} {number % 3}"
        for number in range(1, PARTICLES + 1)
    ]
    bounds = [f"{-edge_um / 2:.16e} {edge_um / 2:.16e}"] * 3
    head = ["ITEM: TIMESTEP", str(step), "ITEM: NUMBER OF ATOMS", str(PARTICLES), "ITEM: BOX BOUNDS pp pp pp", *bounds]
    return "\n".join([*head, f"ITEM: ATOMS {' '.join(COLUMNS)}", *rows]) + "\n"


DUMP = "".join(frame_text(step) for step in (0, 50, 100))


@pytest.fixture
def refusal(tmp_path):
    """What the reader says of a dump that it must refuse; and that it names the file."""

    def say(text: str) -> str:
        path = tmp_path / "a dump"
        path.write_text(text)
        with pytest.raises(InputError) as error:
            list(read_dump(path))
        assert_names_its_file(error.value, path)
        return str(error.value).removeprefix(f"{path}: ")

    return say


def edited(line: int, new: str | None, frame: int = 1) -> str:
    """DUMP with one line of a frame (both counted from 0) replaced, or taken out."""
    lines = DUMP.splitlines(keepends=True)
    lines[frame * LINES + line : frame * LINES + line + 1] = [] if new is None else [new + "\n"]
    return "".join(lines)


def test_good_dump_is_read_in_full_precision(tmp_path):
    (tmp_path / "dump").write_text(DUMP)
    frames = list(read_dump(tmp_path / "dump"))
    assert [frame.step for frame in frames] == [0, 50, 100]
    for frame in frames:
        edge_um = 4.0 - frame.step / 1000
        np.testing.assert_array_equal(frame.lower_um, [-edge_um / 2] * 3)
        np.testing.assert_array_equal(frame.edges_um, [edge_um] * 3)
        assert frame.values.shape == (PARTICLES, len(COLUMNS))
        assert frame.values.dtype == np.float64
        np.testing.assert_allclose(frame.values[:, 3], [1 / 3, 2 / 3, 1], rtol=1e-15)
        np.testing.assert_allclose(frame.values[:, 8], np.array([1, 2, 3]) / 17 - 1, rtol=1e-14)


def test_single_particle(tmp_path):
    lines = frame_text(0).splitlines()
    lines[3] = "1"
    (tmp_path / "dump").write_text("\n".join(lines[:10]) + "\n")
    (frame,) = read_dump(tmp_path / "dump")
    assert frame.values.shape == (1, len(COLUMNS))


# line of the frame, what stands there instead, what the message must hold
@pytest.mark.parametrize(
    ("line", "new", "says"),
    [
        (0, "ITEM: TIME", "line 13: 'ITEM: TIME' in place of 'ITEM: TIMESTEP'"),
        (1, "fifty", "line 14: 'fifty' is no whole number"),
        (1, "0", "line 14: step 0 after step 0: frames of different runs or in disorder"),
        (2, "ITEM: BOX BOUNDS pp pp pp", "line 15: 'ITEM: BOX BOUNDS pp pp pp' in place of 'ITEM: NUMBER OF ATOMS'"),
        (3, "0", "line 16: a frame without particles"),
        (3, "2", "2 particles after 3 in the first frame"),
        (4, "ITEM: BOX BOUNDS ff ff ff", "line 17: 'ITEM: BOX BOUNDS ff ff ff' in place of"),
        (5, "-2.0", "line 18: '-2.0' is no row of 2 finite numbers"),
        (7, "-2.0 inf", "line 20: '-2.0 inf' is no row of 2 finite numbers"),
        (7, "2.0 -2.0", "line 20: the upper bound of the box does not exceed the lower one"),
        (8, "ITEM: ATOMS id type xu yu zu", "line 21: columns id type xu yu zu in place of id type radius xu yu zu"),
        (8, f"ITEM: ATOMS {' '.join(sorted(COLUMNS))}", "line 21: columns "),
        (9, "1 2 0.1428", "line 22: '1 2 0.1428' is no row of 10 finite numbers"),
        (10, "2 1 0.28 nan 0 0 0 0 0 2", "line 23: '2 1 0.28 nan 0 0 0 0 0 2' is no row of 10 finite numbers"),
        (10, "2 1 0.28 1_0 0 0 0 0 0 2", "line 23: '2 1 0.28 1_0 0 0 0 0 0 2' is no row of 10 finite numbers"),
        (11, "3 2 0.428571428571429 1 -1 0 0 0 0 0 9", "line 24: "),
        (11, "4 2 0.428571428571429 1 -1 0 0 0 0 0", "line 24: id, type or radius differ from those of the first"),
        (11, "3 1 0.428571428571429 1 -1 0 0 0 0 0", "line 24: id, type or radius differ from those of the first"),
        (11, "3 2 0.5 1 -1 0 0 0 0 0", "line 24: id, type or radius differ from those of the first frame"),
        (9, None, "line 24: 'ITEM: TIMESTEP' is no row of 10 finite numbers"),
    ],
)
def test_corrupt_line_is_refused_with_frame_and_line(refusal, line, new, says):
    message = refusal(edited(line, new))
    assert message.startswith("frame 1, line ")
    assert says in message


@pytest.mark.parametrize(
    ("sources", "says"),
    [((10, 9), "are not sorted by id"), ((9, 11, 10), "are not sorted by id"), ((9, 9), "an id stands twice")],
)
def test_unsorted_or_repeated_ids_are_refused(refusal, sources, says):
    lines = DUMP.splitlines(keepends=True)
    lines[9 : 9 + len(sources)] = [lines[source] for source in sources]
    message = refusal("".join(lines))
    assert message.startswith("frame 0, line 12: ") and says in message


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "holds no frame"),
        ("Step Temp\n0 300\n", "frame 0, line 1: 'Step Temp' in place of 'ITEM: TIMESTEP'"),
        (frame_text(0) + frame_text(50) + frame_text(50), "frame 2, line 26: step 50 after step 50"),
    ],
)
def test_other_files_and_frames_of_two_runs_are_refused(refusal, text, says):
    assert refusal(text).startswith(says)


@given(st.integers(1, len(DUMP) - 1))
def test_dump_cut_anywhere_is_refused_unless_cut_between_frames(tmp_path_factory, length):
    path = tmp_path_factory.getbasetemp() / "cut.dump"
    path.write_text(DUMP[:length])
    whole, rest = divmod(DUMP[:length].count("\n"), LINES)
    if rest or DUMP[length - 1] != "\n":
        with pytest.raises(InputError, match=rf"cut\.dump: frame {whole}, line \d+: "):
            list(read_dump(path))
    else:
        assert [frame.step for frame in read_dump(path)] == [0, 50, 100][:whole]


@given(st.integers(0, len(DUMP) - 1), st.characters(max_codepoint=126))
def test_one_wrong_character_is_refused_or_changes_one_number(tmp_path_factory, place, character):
    """Digits for digits cannot be noticed; all else must end in the one-line error and never in another one."""
    path = tmp_path_factory.getbasetemp() / "wrong.dump"
    path.write_text(DUMP)
    good = list(read_dump(path))
    path.write_text(DUMP[:place] + character + DUMP[place + 1 :])
    try:
        frames = list(read_dump(path))
    except InputError:
        return
    assert len(frames) == len(good)
    changed = 0
    for frame, expected in zip(frames, good, strict=True):
        assert np.isfinite(frame.values).all()
        assert (frame.edges_um > 0).all()
        changed += frame.step != expected.step
        changed += np.sum((frame.lower_um != expected.lower_um) | (frame.edges_um != expected.edges_um))
        changed += np.sum(frame.values[:, 3:] != expected.values[:, 3:])
    assert changed <= 1


@settings(max_examples=300, deadline=None)
@given(content=variants(DUMP))
@example(DUMP.replace("ATOMS\n3\n", f"ATOMS\n{'9' * 5000}\n").encode())
@example(DUMP.replace("ATOMS\n3\n", f"ATOMS\n{'9' * 30}\n").encode())
@example(DUMP.replace("TIMESTEP\n0\n", f"TIMESTEP\n{'9' * 30}\n").encode())
@example(DUMP.replace("ATOMS\n3\n", "ATOMS\n²\n").encode())
def test_any_dump_is_read_or_refused_with_its_place(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "any.dump"
    path.write_bytes(content)
    try:
        frames = list(read_dump(path))
    except InputError as error:
        assert_names_its_file(error, path)
    else:
        assert frames
        assert all(np.isfinite(frame.values).all() and (frame.edges_um > 0).all() for frame in frames)
