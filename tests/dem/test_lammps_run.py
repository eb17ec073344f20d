"""LAMMPS itself: a chain of restarts, MPI ranks, and every way in which a start can fail."""

import re
import shlex
import shutil
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from data_files import atoms, bounds_um
from slurrycast.dem import lammps_run
from slurrycast.dem.lammps_dump import read_dump
from slurrycast.dem.lammps_run import Launcher, Progress, refuse_lost_history, run_lammps
from slurrycast.runtime.files import InputError, RunError

ONE_RANK = Launcher("lmp", "mpiexec", 1)
SCRIPTS = {path.name: path.read_text() for path in lammps_run.SCRIPTS.glob("*.lmp")}
PAIR_STYLE = SCRIPTS["start.lmp"][SCRIPTS["start.lmp"].index("pair_style") : SCRIPTS["start.lmp"].index("include")]


@pytest.fixture
def folder(tmp_path, slurry) -> Path:
    """A work folder, its path with a space, from which the slurry goes on at step 3000, where it is dense."""
    path = tmp_path / "work folder"
    path.mkdir()
    for name in ("initial.data", "coefficients.lmp", "push_off.lmp"):
        shutil.copyfile(slurry / name, path / name)
    shutil.copyfile(slurry / "frame_60.restart", path / "step_3000.restart")
    return path


def push_off(folder: Path, variables: dict, launcher: Launcher = ONE_RANK):
    return run_lammps(launcher, "push_off.lmp", variables, folder, "push_off.log")


@pytest.mark.parametrize("apart_um", [0.0, 1e-7])
def test_particles_in_one_place_are_pushed_apart(folder, variables, apart_um):
    """However few iterations a round has, and however well the others are apart already."""
    lines = (folder / "initial.data").read_text().splitlines()
    first = lines.index("Atoms # sphere") + 2
    place = lines[first].split()[4:7]
    words = lines[first + 1].split()
    words[4:7] = [repr(float(place[0]) + apart_um), *place[1:]]
    (folder / "initial.data").write_text("\n".join([*lines[: first + 1], " ".join(words), *lines[first + 2 :]]) + "\n")
    push_off(folder, {**variables, "push_off_iterations": 5})
    pushed = atoms(folder / "pushed_off.data")
    ids = [float(lines[first].split()[0]), float(words[0])]
    one, other = pushed[np.isin(pushed[:, 0], ids)]
    assert np.linalg.norm(one[4:7] - other[4:7]) > 0.6 * (one[2] + other[2]) / 2


@pytest.fixture
def program(tmp_path) -> Callable[[str], str]:
    """Write a shell script that stands for a program; return its path."""

    def write(text: str) -> str:
        path = tmp_path / "a program"
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)
        return str(path)

    return write


def segment(folder: Path, variables: dict, first: int, last: int, launcher: Launcher = ONE_RANK):
    return run_lammps(launcher, "slurry.lmp", {**variables, "from": first, "to": last}, folder, f"segment_{last}.log")


@pytest.fixture
def use_script(tmp_path, monkeypatch) -> Callable[[str, str], None]:
    """Put a text in the place of a LAMMPS script; after the first time, only such scripts are found."""

    def use(name: str, text: str) -> None:
        (tmp_path / name).write_text(text)
        monkeypatch.setattr(lammps_run, "SCRIPTS", tmp_path)

    return use


def values_after_segment(folder: Path, variables: dict, first: int, last: int) -> np.ndarray:
    """Columns of the dump at step `last`."""
    segment(folder, variables, first, last)
    *_, frame = read_dump(folder / f"frames_{last}.dump")
    assert frame.step == last
    return frame.values


def test_chain_continued_from_a_restart_file_is_bit_equal(folder, variables, tmp_path):
    """In a new process and another folder, from nothing but the restart file in the middle."""
    segment(folder, variables, 3000, 3200)
    undisturbed = segment(folder, variables, 3200, 3400)
    other = tmp_path / "other"
    other.mkdir()
    for name in ("coefficients.lmp", "step_3200.restart"):
        shutil.copyfile(folder / name, other / name)
    continued = segment(other, variables, 3200, 3400)
    np.testing.assert_array_equal(continued.thermo, undisturbed.thermo)
    for name in ("frames_3400.dump", "step_3400.restart"):
        assert (other / name).read_bytes() == (folder / name).read_bytes()


def test_restart_files_hold_the_whole_state(folder, variables, use_script):
    """A chain of segments is on the very trajectory of one process that makes the same runs without restart files.

    Contact history and barostat have to survive for that. One run without stops would differ a little: LAMMPS computes
    damping forces anew at the start of each run, with velocities of the full instead of the half step.
    """
    stops = range(3000, 3401, 50)
    for first, last in pairwise(stops):
        segment(folder, variables, first, last)
        log = (folder / f"segment_{last}.log").read_text()
        assert "Unused restart file" not in log
        assert "WARNING" not in log
    chain = [frame for last in stops[1:] for frame in read_dump(folder / f"frames_{last}.dump")]

    runs = "\n".join(f"run {last} upto" for last in stops[1:])
    use_script("slurry.lmp", SCRIPTS["slurry.lmp"].replace("run             ${to} upto", runs))
    segment(folder, variables, 3000, 3400)
    one_process = list(read_dump(folder / "frames_3400.dump"))
    assert [frame.step for frame in chain] == [frame.step for frame in one_process] == list(range(3050, 3401, 50))
    for frame, expected in zip(chain, one_process, strict=True):
        np.testing.assert_allclose(frame.values, expected.values, rtol=0, atol=1e-11)
        np.testing.assert_allclose(frame.edges_um, expected.edges_um, rtol=1e-12)

    use_script("slurry.lmp", SCRIPTS["slurry.lmp"].replace("include ", f"{PAIR_STYLE}\ninclude ", 1))
    lost = values_after_segment(folder, variables, 3350, 3400)  # the contact history
    assert np.abs(lost - chain[-1].values).max() > 1e-6


@pytest.fixture
def displaced(folder, variables) -> Callable[[float], Path]:
    """Displace the particles at step 3000 in a part of its own; return its log."""

    def run(displacement_um: float) -> Path:
        source = folder / "start.restart"
        if not source.exists():
            (folder / "step_3000.restart").rename(source)
        own = {"restart": source.name, "from": 3000, "displacement_um": displacement_um, "displacement_seed": 5}
        run_lammps(ONE_RANK, "displace.lmp", {**variables, **own}, folder, "displace.log")
        return folder / "displace.log"

    return run


def test_displacement_of_nothing_changes_nothing(folder, variables, displaced, use_script):
    """250 steps on; not so if it drops the contact history."""
    expected = values_after_segment(folder, variables, 3000, 3250)
    use_script("slurry.lmp", SCRIPTS["slurry.lmp"])
    displace = SCRIPTS["displace.lmp"]
    moved_by_nothing = displace.replace('"${displacement_um} > 0"', '"1 > 0"').replace(
        "all random ${displacement_um} ${displacement_um} &\n                ${displacement_um} ${displacement_seed}",
        "all move 0 0 0",
    )
    assert moved_by_nothing.count("all move 0 0 0") == 1
    for text in (displace, moved_by_nothing):
        use_script("displace.lmp", text)
        assert "Unused restart file" not in displaced(0).read_text()
        np.testing.assert_array_equal(values_after_segment(folder, variables, 3000, 3250), expected)
        assert "Unused restart file" not in (folder / "segment_3250.log").read_text()

    use_script("displace.lmp", displace.replace("include ", f"{PAIR_STYLE}\ninclude ", 1))
    log = displaced(0)
    assert np.abs(values_after_segment(folder, variables, 3000, 3250) - expected).max() > 1e-6
    with pytest.raises(RunError, match=r"dropped a part of the restart file start\.restart; log: .*displace\.log"):
        refuse_lost_history(log, Path("start.restart"))


def test_displaced_chain_is_on_the_trajectory_of_one_process(folder, variables, displaced, use_script):
    """The contact history survives a displacement that is more than nothing, too."""
    displaced(1e-6)
    chain = values_after_segment(folder, variables, 3000, 3250)
    random = "displace_atoms all random 1e-6 1e-6 1e-6 5"
    use_script("slurry.lmp", SCRIPTS["slurry.lmp"].replace("run  ", f"run 0\n{random}\nrun  ", 1))
    shutil.copyfile(folder / "start.restart", folder / "step_3000.restart")
    np.testing.assert_allclose(values_after_segment(folder, variables, 3000, 3250), chain, rtol=0, atol=1e-11)


def test_start_writes_step_0_and_its_frame_is_the_first(folder, variables):
    for script in ("push_off", "start"):
        assert run_lammps(ONE_RANK, f"{script}.lmp", variables, folder, f"{script}.log").ranks == 1
    segment(folder, variables, 0, 50)
    first, second = read_dump(folder / "frames_50.dump")
    assert (first.step, second.step) == (0, 50)
    rows, bounds = (read(folder / "pushed_off.data") for read in (atoms, bounds_um))
    unwrapped_um = rows[:, 4:7] + rows[:, 7:10] * (bounds[:, 1] - bounds[:, 0])
    np.testing.assert_allclose(first.values[:, 3:6], unwrapped_um, atol=1e-12)


def test_two_ranks_follow_the_same_trajectory(folder, variables):
    one = segment(folder, variables, 3000, 3050)
    (alone,) = read_dump(folder / "frames_3050.dump")
    two = segment(folder, variables, 3000, 3050, Launcher("lmp", "mpiexec", 2))
    (together,) = read_dump(folder / "frames_3050.dump")
    assert (one.ranks, two.ranks) == (1, 2)
    np.testing.assert_allclose(together.values, alone.values, atol=1e-9)
    assert " MPI tasks x 1 OpenMP threads" in (folder / "segment_3050.log").read_text()


@pytest.mark.parametrize(
    ("variables_of_launcher", "ranks"),
    [
        ("PMI_FD=9 PMI_RANK=0 PMI_SIZE=1", 1),
        ("PMI_PORT=localhost:9 PMI_ID=0", 1),
        ("PMIX_NAMESPACE=prterun-1 PMIX_RANK=0", 1),
        ("PMIX_NAMESPACE=prterun-1 PMIX_RANK=0", 2),
        ("PMI_FD=9 PMI_RANK=3 PMI_SIZE=4 MPI_LOCALRANKID=3 MPI_LOCALNRANKS=4", 2),
    ],
)
def test_variables_of_an_outer_launcher_do_no_harm(folder, variables, monkeypatch, variables_of_launcher, ranks):
    for setting in variables_of_launcher.split():
        monkeypatch.setenv(*setting.split("="))
    assert push_off(folder, variables, Launcher("lmp", "mpiexec", ranks)).ranks == ranks


def test_small_shared_memory_is_named(folder, variables, program, monkeypatch):
    usage = shutil.disk_usage(folder)._replace(free=16 << 20)
    monkeypatch.setattr(lammps_run.shutil, "disk_usage", lambda _: usage)
    launcher = program("echo\nexit 249")  # as MPICH's launcher does then
    says = r"code 249 \(as after signal 7, Bus error\): it printed nothing; /dev/shm, .* has only 16 MB free$"
    with pytest.raises(RunError, match=says):
        push_off(folder, variables, Launcher("lmp", launcher, 2))


def test_launcher_that_starts_copies_of_one_rank_is_noticed(folder, variables, program):
    launcher = program('shift 2\n"$@"\n"$@"')  # ignores `-n 2`
    with pytest.raises(RunError) as error:
        push_off(folder, variables, Launcher("lmp", launcher, 2))
    assert str(error.value) == (
        f"LAMMPS ran on 1 MPI ranks where dem.ranks asks for 2: check dem.launcher; log: {folder / 'push_off.log'}"
    )


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"data": "missing.data"}, "missing.data"),
        ({"coefficients": "push_off.lmp"}, "ERROR"),
        ({"timestep_us": 5.0}, "NaN or infinite values"),
    ],
    ids=["missing file", "wrong coefficients", "exploding"],
)
def test_failure_of_lammps_is_passed_on_with_the_place_of_the_log(folder, variables, change, says):
    with pytest.raises(RunError) as error:
        for script in ("push_off", "start"):
            run_lammps(ONE_RANK, f"{script}.lmp", {**variables, **change}, folder, f"{script}.log")
        segment(folder, {**variables, **change}, 0, 500)
    message = str(error.value)
    assert message.startswith("LAMMPS: ")
    assert says in message
    log = Path(message.partition("; log: ")[2])
    assert log.parent == folder
    assert log.exists()
    assert "\n" not in message


def test_launcher_that_starts_nothing_is_named(folder, variables):
    with pytest.raises(RunError, match=r"^LAMMPS wrote no log: it printed nothing; check dem\.launcher$"):
        push_off(folder, variables, Launcher("lmp", "true", 2))


def test_earlier_log_is_not_mistaken_for_that_of_a_run_that_wrote_none(folder, variables):
    push_off(folder, variables)
    for executable, says in (("true", "LAMMPS wrote no log"), ("false", "ended with exit code 1")):
        with pytest.raises(RunError, match=says):
            push_off(folder, variables, Launcher(executable, "mpiexec", 1))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "echo 'libmpi.so.12: cannot open shared object file' >&2\nexit 127",
            "LAMMPS ended with exit code 127: libmpi.so.12: cannot open shared object file",
        ),
        # ranks other than the first one, and MPI itself, write to the screen and not to the log
        ("echo 'ERROR on proc 1: Out of range atoms'\nexit 1", "LAMMPS: ERROR on proc 1: Out of range atoms"),
        ("echo 'out of licences'\nprintf '\\n\\n\\n\\n\\n\\n'\nexit 3", "exit code 3: out of licences"),
        ("echo\nexit 3", "LAMMPS ended with exit code 3: it printed nothing"),
        ("kill -9 $$", "LAMMPS ended with signal 9 (Killed): it printed nothing; memory may have run out"),
        (
            "[ $1 = -h ] || { echo 'ERROR: Illegal dump_modify command'; exit 1; }\n"
            "echo 'Massively Parallel Simulator - 23 Jun 2022'",
            "is LAMMPS 23 Jun 2022: must be 2 Aug 2023 or newer",
        ),
        ("exit 0", "a program' does not answer -h as LAMMPS does: it printed nothing"),
        ("[ $1 = -h ] && exit 1\necho 'no licence'", "LAMMPS wrote no log: no licence"),
    ],
)
def test_words_that_only_the_screen_shows_are_passed_on(folder, variables, program, text, says):
    with pytest.raises(RunError, match=re.escape(says) + "$"):  # and no log that was not written
        push_off(folder, variables, Launcher(program(text), "mpiexec", 1))


@pytest.mark.parametrize(
    ("free", "cause"), [(1 << 30, ""), (1000, "; the disk is full"), (None, "; the work folder is gone")]
)
def test_what_lammps_does_not_say_is_added(folder, variables, tmp_path, program, monkeypatch, free, cause):
    remove = f"rm -r '{folder}'" if free is None else ":"
    failing = program(f"{remove}\necho 'ERROR: Unexpected end of data file'\nexit 1")
    usage = lammps_run.shutil.disk_usage(tmp_path)._replace(free=free or 1 << 30)
    monkeypatch.setattr(lammps_run.shutil, "disk_usage", lambda _: usage)
    with pytest.raises(RunError) as error:
        push_off(folder, variables, Launcher(failing, "mpiexec", 1))
    assert str(error.value) == f"LAMMPS: ERROR: Unexpected end of data file{cause}"


def test_executable_may_be_given_relative_to_the_project(folder, variables, tmp_path, monkeypatch):
    (tmp_path / "my bin").mkdir()
    (tmp_path / "my bin" / "lmp").symlink_to(shutil.which("lmp"))
    monkeypatch.chdir(tmp_path)
    assert Launcher("my bin/lmp", "mpiexec", 1).command() == [str(tmp_path / "my bin" / "lmp")]
    assert push_off(folder, variables, Launcher("my bin/lmp", "mpiexec", 1)).ranks == 1


@pytest.mark.parametrize(
    ("launcher", "key", "program"),
    [
        (Launcher("lmp_of_nobody", "mpiexec", 1), "dem.executable", "lmp_of_nobody"),
        (Launcher("/no/such/lmp", "mpiexec", 2), "dem.executable", "/no/such/lmp"),
        (Launcher("lmp", "mpiexec_of_nobody", 2), "dem.launcher", "mpiexec_of_nobody"),
    ],
)
def test_missing_program_is_named_with_its_key(launcher, key, program):
    with pytest.raises(InputError) as error:
        launcher.command()
    assert str(error.value) == f"{key}: {program!r} is not on PATH; give the name or path of an existing program"


def test_command_lines():
    python = sys.executable
    assert Launcher(python, "not asked for", 1).command() == [python]
    quoted = shlex.quote(python)
    command = Launcher(f"{quoted} -k on", f"{quoted} --exact", 4).command()
    assert shlex.join(command) == f"{quoted} --exact -n 4 {quoted} -k on"


def test_progress_is_fed_from_the_thermo_table(folder, variables):
    calls = []
    settings = {**variables, "from": 3000, "to": 3200}
    log = run_lammps(
        ONE_RANK, "slurry.lmp", settings, folder, "a.log", lambda step, density: calls.append((step, density))
    )
    assert [step for step, _ in calls] == [3000, 3050, 3100, 3150, 3200]
    assert [density for _, density in calls] == log.thermo[:, 2].tolist()


@pytest.mark.parametrize(("every_s", "lines"), [(0.0, 2), (60.0, 0)])
def test_progress_says_how_far_and_how_long_and_not_too_often(every_s, lines):
    said = []
    progress = Progress("T1", 100, 1100, said.append, every_s)
    for step, density in ((100, 1.0), (600, 1.5), (800, 1.6)):  # the first row says nothing about the speed
        progress(step, density)
    assert len(said) == lines
    if said:
        assert said[0].startswith("[T1] step 600 of 1100 (55%), density 1.500 g/cm3, 0 s, about 0 s left")
