"""The log reader: a good log, and every way in which a run says, or does not say, that it failed."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from damage import variants
from slurrycast.dem.lammps_log import END_MARKER, read_log, thermo_row
from slurrycast.runtime.files import RunError

GOOD = """\
LAMMPS (22 Jul 2025 - Update 4)
  using 1 OpenMP thread(s) per MPI task
units           micro
Reading data file ...
  orthogonal box = (-2 -2 -2) to (2 2 2)
  1 by 1 by 2 MPI processor grid
  78 atoms
WARNING: Communication cutoff is 0 (src/comm.cpp:730)
run             400 upto
Per MPI rank memory allocation (min/avg/max) = 5.1 | 5.2 | 5.3 Mbytes
   Step        v_time_us    v_density_g_cm3     Press
       200   0.4            1.25              99.5
WARNING: Dump frames includes no atoms (src/dump.cpp:1)
       300   0.6            1.375            100.25
       400   0.8            1.5              101.325
Loop time of 2.5 on 2 procs for 200 steps with 78 atoms

98.0% CPU use with 2 MPI tasks x 1 OpenMP threads

MPI task timing breakdown:
Section |  min time  |  avg time  |  max time  |%varavg| %total
Pair    | 0.1        | 0.1        | 0.1        |   0.0 | 80.00
Nlocal:             39 ave          40 max          38 min
Histogram: 1 0 0 0 0 0 0 0 0 1
Total # of neighbors = 400
Total wall time: 0:00:02
"""


@pytest.fixture
def log(tmp_path):
    def write(text: str):
        path = tmp_path / "segment 400.log"
        path.write_text(text)
        return path

    return write


def test_good_log(log):
    found = read_log(log(GOOD))
    assert found.version == "22 Jul 2025 - Update 4"
    assert found.ranks == 2
    assert found.columns == ("Step", "v_time_us", "v_density_g_cm3", "Press")
    expected = [[200, 0.4, 1.25, 99.5], [300, 0.6, 1.375, 100.25], [400, 0.8, 1.5, 101.325]]
    np.testing.assert_array_equal(found.thermo, expected)


def test_last_run_of_a_log_counts(log):
    first = GOOD[GOOD.index("   Step") : GOOD.index("MPI task")].replace("v_density_g_cm3", "Temp").replace("2.5", "9")
    found = read_log(log(GOOD.replace("run             400", first + "run             400")))
    assert found.columns[2] == "v_density_g_cm3"
    assert len(found.thermo) == 3


def test_log_without_a_run_has_no_table(log):
    """start.lmp only writes a restart file."""
    text = GOOD[: GOOD.index("run ")] + "Total wall time: 0:00:00\n"
    found = read_log(log(text))
    assert (found.columns, found.thermo.size, found.ranks) == ((), 0, 2)


@pytest.mark.parametrize(
    "message",
    [
        "ERROR: Lost atoms: original 78 current 77 (src/thermo.cpp:494)",
        "ERROR on proc 1: Neighbor list overflow, boost neigh_modify one (src/npair_bin.cpp:214)",
        "ERROR: Unknown pair style gran/hertz/history (src/force.cpp:275)",
    ],
)
@pytest.mark.parametrize("ended", [True, False])
def test_error_is_passed_on_with_the_place_of_the_log(log, message, ended):
    lines = GOOD.splitlines(keepends=True)
    path = log("".join([*lines[:14], message + "\n", "Last input line: run 400 upto\n", *lines[-1 if ended else 99 :]]))
    with pytest.raises(RunError) as error:
        read_log(path)
    assert str(error.value) == f"LAMMPS: {message}; log: {path}"


@pytest.mark.parametrize("word", ["nan", "-nan", "inf", "-inf", "NaN"])
def test_value_that_is_not_finite_is_named_with_its_step(log, word):
    path = log(GOOD.replace("100.25", word))
    with pytest.raises(RunError) as error:
        read_log(path)
    assert str(error.value) == f"LAMMPS: NaN or infinite values at step 300; log: {path}"


@given(st.integers(0, GOOD.index(END_MARKER) + len(END_MARKER) - 1))
def test_log_cut_anywhere_before_its_end_is_refused(tmp_path_factory, length):
    path = tmp_path_factory.getbasetemp() / "cut.log"
    path.write_text(GOOD[:length])
    with pytest.raises(RunError, match=r"cut\.log$") as error:
        read_log(path)
    assert "the run was cut off" in str(error.value)


def test_missing_log(tmp_path):
    with pytest.raises(RunError, match=r"LAMMPS wrote no log: No such file or directory; log: .*none\.log"):
        read_log(tmp_path / "none.log")


@pytest.mark.parametrize(
    ("grid", "ranks"), [("1 by 1 by 1 MPI processor grid", 1), ("3 by 2 by 4 MPI processor grid", 24), ("", 0)]
)
def test_ranks_are_those_of_the_processor_grid(log, grid, ranks):
    """0 if there is none and they are not known."""
    assert read_log(log(GOOD.replace("1 by 1 by 2 MPI processor grid", grid))).ranks == ranks


def test_bytes_that_are_no_text_do_no_harm(tmp_path):
    (tmp_path / "a.log").write_bytes(b"\xff\xfe\x00" + GOOD.encode())
    assert len(read_log(tmp_path / "a.log").thermo) == 3


@pytest.mark.parametrize(
    ("line", "row"),
    [
        ("  200 0.4 1.25", [200, 0.4, 1.25]),
        ("  200 0.4 nan", [200, 0.4, np.nan]),
        ("200 0.4", None),
        ("200 0.4 1.25 3", None),
        ("-200 0.4 1.25", None),
        ("0.2 0.4 1.25", None),
        ("", None),
    ],
)
def test_thermo_row(line, row):
    np.testing.assert_equal(thermo_row(line, 3), row)


@settings(max_examples=300, deadline=None)
@given(content=variants(GOOD))
@example(GOOD.replace("1 by 1 by 2", f"{'9' * 5000} by 1 by 1").encode())
@example(GOOD.replace("300   0.6", f"{'9' * 400}   nan").encode())
@example(GOOD.replace("   Step        v_time_us", "   Step  Step").encode())
def test_any_log_is_read_or_refused_with_its_place(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "any.log"
    path.write_bytes(content)
    try:
        log = read_log(path)
    except RunError as error:
        assert str(error).endswith(f"log: {path}")
        assert len(str(error).splitlines()) == 1
    else:
        assert np.isfinite(log.thermo).all()
        assert log.thermo.shape == (len(log.thermo), len(log.columns))
