"""The frame store: round trip, agreement with the dump and with MDAnalysis, and refusal of broken files."""

import shutil
import subprocess
from dataclasses import replace

import h5py
import MDAnalysis
import numpy as np
import pytest

from slurrycast.data.frames import GROUP, Frame, Particles, read_frames, write_frames
from slurrycast.dem.lammps_dump import read_dump
from slurrycast.runtime.files import CHECKSUMS, InputError
from structures import random_frame, random_particles

N = 20


@pytest.fixture(scope="module")
def particles() -> Particles:
    return random_particles(N)


@pytest.fixture(scope="module")
def frames() -> list[Frame]:
    return [random_frame(number, N) for number in (7, 8, 120)]


@pytest.fixture
def store_path(tmp_path, particles, frames):
    write_frames(tmp_path / "a.h5", particles, iter(frames), {"slurry": "A", "scale": 0.5, "input_frames": [7, 8]})
    return tmp_path / "a.h5"


def test_round_trip(store_path, particles, frames):
    with read_frames(store_path) as store:
        for name in ("id", "type", "phase", "size_class", "radius_um", "mass_pg"):
            np.testing.assert_array_equal(getattr(store.particles, name), getattr(particles, name))
        assert store.particles.phase_names == particles.phase_names
        assert len(store.particles) == N
        assert store.frame_numbers.tolist() == [7, 8, 120]
        assert store.last == 120
        assert store.steps.tolist() == [350, 400, 6000]
        assert store.times_us.tolist() == pytest.approx([0.7, 0.8, 12.0])
        for frame in frames:
            np.testing.assert_array_equal(store.position_um(frame.number), frame.position_um)
            np.testing.assert_array_equal(store.scaled_position(frame.number), frame.scaled_position)
            np.testing.assert_array_equal(store.coordination(frame.number), frame.coordination)
            np.testing.assert_array_equal(store.box(frame.number), (frame.lower_um, frame.edges_um))
        assert store.volume_um3(7) == pytest.approx(np.prod(frames[0].edges_um))
        assert store.density_g_cm3(7) == pytest.approx(particles.mass_pg.sum() / np.prod(frames[0].edges_um))
        assert (store.attributes["slurry"], store.attributes["scale"]) == ("A", 0.5)
        assert list(store.attributes["input_frames"]) == [7, 8]


@pytest.fixture
def doubtful_path(tmp_path, particles, frames):
    """A store whose frames have a spread."""
    rng = np.random.default_rng(3)
    doubtful = [replace(frame, position_spread_um=rng.uniform(0.1, 0.2, (N, 3))) for frame in frames]
    write_frames(tmp_path / "b.h5", particles, iter(doubtful), {"slurry": "A"})
    with read_frames(tmp_path / "b.h5") as store:
        for frame in doubtful:
            np.testing.assert_array_equal(store.position_spread_um(frame.number), frame.position_spread_um)
            np.testing.assert_array_equal(store.frame(frame.number).position_spread_um, frame.position_spread_um)
    return tmp_path / "b.h5"


def test_a_spread_is_optional(store_path, doubtful_path):
    """What a store without one holds is what it held before there were any."""
    with h5py.File(doubtful_path) as file:
        spread = file[f"{GROUP}/position_spread"]
        assert set(spread) == {"step", "time", "value"}
        assert spread["value"].attrs["units"] == "um"
        assert (spread["value"].compression, spread["value"].fletcher32) == ("gzip", True)
    with h5py.File(store_path) as file:
        assert "position_spread" not in file[GROUP]
    with read_frames(store_path) as store:
        assert store.position_spread_um(7) is None
        assert store.frame(7).position_spread_um is None


@pytest.mark.parametrize("spread", [np.ones((3, N)), np.ones((3, N, 2)), np.ones((2, N, 3)), np.full((3, N, 3), b"1")])
def test_a_spread_of_another_shape_or_kind_is_refused(doubtful_path, spread):
    with h5py.File(doubtful_path, "a") as file:
        del file[f"{GROUP}/position_spread/value"]
        file[f"{GROUP}/position_spread/value"] = spread
    shutil.rmtree(doubtful_path.parent / CHECKSUMS)
    with pytest.raises(InputError, match=r"b\.h5: not a readable frame store \(position_spread/value holds .*expected"):
        read_frames(doubtful_path)


def test_a_spread_is_in_all_frames_or_in_none(tmp_path, particles, frames):
    doubtful = replace(frames[1], position_spread_um=np.ones((N, 3)))
    for those in ([frames[0], doubtful], [doubtful, frames[0]]):
        with pytest.raises(ValueError, match="does not hold the same quantities as the first one"):
            write_frames(tmp_path / "c.h5", particles, those, {})
        assert not (tmp_path / "c.h5").exists()


def test_mask_of_a_phase(particles):
    np.testing.assert_array_equal(particles.in_phase("8YSZ"), np.arange(N) >= N // 2)


def test_frames_are_compressed_checksummed_and_chunked_one_by_one(store_path):
    with h5py.File(store_path) as file:
        for name in ("position", "scaled_position", "coordination"):
            data = file[f"{GROUP}/{name}/value"]
            assert (data.compression, data.fletcher32, data.chunks[0]) == ("gzip", True, 1)
            assert data.chunks[1:] == data.shape[1:]
        assert file[f"{GROUP}/position/value"].dtype == np.float64


def test_every_quantity_says_its_units(store_path):
    units = {"radius": "um", "mass": "pg", "box/edges/value": "um", "box/lower/value": "um", "id": ""}
    units |= {"position/value": "um", "scaled_position/value": "", "coordination/value": "", "position/time": "us"}
    with h5py.File(store_path) as file:
        assert {name: file[GROUP][name].attrs["units"] for name in units} == units


def test_layout_is_h5md(store_path):
    """The elements that H5MD 1.1 demands of a file and of a particle group."""
    with h5py.File(store_path) as file:
        assert file["h5md"].attrs["version"].tolist() == [1, 1]
        assert file["h5md/author"].attrs["name"]
        assert file["h5md/creator"].attrs["name"]
        assert file["h5md/creator"].attrs["version"]
        box = file[f"{GROUP}/box"]
        assert box.attrs["dimension"] == 3
        assert list(box.attrs["boundary"]) == ["periodic"] * 3
        for element in ("position", "box/edges", "box/lower", "coordination", "scaled_position"):
            assert set(file[f"{GROUP}/{element}"]) == {"step", "time", "value"}
            assert len(file[f"{GROUP}/{element}/step"]) == len(file[f"{GROUP}/{element}/value"])


@pytest.mark.parametrize("method", ["position_um", "scaled_position", "coordination", "box", "volume_um3"])
def test_missing_frame_is_named(store_path, method):
    with read_frames(store_path) as store, pytest.raises(InputError, match=r"a\.h5: frame 9 is not in the file.*7 to"):
        getattr(store, method)(9)


def test_other_files_are_refused(tmp_path):
    (tmp_path / "text.h5").write_text("no HDF5")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["features"] = np.zeros(3)
    unreadable = "not a readable frame store"
    for name, says in {"none.h5": "no such file", "text.h5": unreadable, "other.h5": unreadable}.items():
        with pytest.raises(InputError, match=rf"{name}: {says}"):
            read_frames(tmp_path / name)


@pytest.mark.parametrize("name", ["position", "scaled_position", "coordination", "position_spread"])
def test_wrong_byte_in_a_frame_is_noticed(doubtful_path, name):
    store_path = doubtful_path
    with h5py.File(store_path) as file:
        chunk = file[f"{GROUP}/{name}/value"].id.get_chunk_info(1)
    content = bytearray(store_path.read_bytes())
    content[chunk.byte_offset + chunk.size // 2] ^= 1
    store_path.write_bytes(content)
    with pytest.raises(InputError, match=r"b\.h5: not what was written there"):
        read_frames(store_path)
    shutil.rmtree(store_path.parent / CHECKSUMS)  # and where that is not known
    with read_frames(store_path) as store:
        read = getattr(store, f"{name}_um" if name.startswith("position") else name)
        read(7)
        with pytest.raises(InputError, match=r"b\.h5: not a readable frame store"):
            read(8)


def test_failed_writing_leaves_the_earlier_file(store_path, particles, frames):
    def failing():
        yield frames[0]
        raise InputError("the dump ends here")

    before = store_path.read_bytes()
    with pytest.raises(InputError, match="the dump ends here"):
        write_frames(store_path, particles, failing(), {})
    assert store_path.read_bytes() == before
    assert {path.name for path in store_path.parent.iterdir()} == {"a.h5", CHECKSUMS}


def test_slurry_agrees_with_its_dump(slurry):
    with read_frames(slurry / "frames.h5") as store:
        numbers = []
        for number, frame in enumerate(read_dump(slurry / "dump.lammpstrj")):
            np.testing.assert_array_equal(store.particles.id, frame.values[:, 0])
            np.testing.assert_allclose(store.position_um(number), frame.values[:, 3:6], rtol=0, atol=1e-9)
            np.testing.assert_allclose(store.scaled_position(number), frame.values[:, 6:9], rtol=0, atol=1e-9)
            np.testing.assert_array_equal(store.coordination(number), frame.values[:, 9])
            np.testing.assert_array_equal(store.box(number), (frame.lower_um, frame.edges_um))
            # the position is the scaled one in the box of its frame, which is centred at the origin at all times
            np.testing.assert_allclose(frame.lower_um, -frame.edges_um / 2, atol=1e-9)
            position_um = frame.lower_um + store.scaled_position(number) * frame.edges_um
            np.testing.assert_allclose(store.position_um(number), position_um, rtol=0, atol=1e-9)
            assert store.steps[number] == frame.step == 50 * number
            assert store.times_us[number] == pytest.approx(frame.step * 2e-3)
            numbers.append(number)
        assert store.frame_numbers.tolist() == numbers == list(range(121))
        assert (store.box(0)[1] - store.box(120)[1] > 0.5).all()  # a box that stays the same would say little
        assert {"slurry", "physics", "seeds", "lammps_version"} <= set(store.attributes)


def test_mdanalysis_h5md_reader_agrees(slurry):
    with read_frames(slurry / "frames.h5") as store:
        universe = MDAnalysis.Universe.empty(len(store.particles), trajectory=True)
        universe.load_new(str(slurry / "frames.h5"), format="H5MD", convert_units=False)
        assert len(universe.trajectory) == 121
        for k, moment in enumerate(universe.trajectory):
            np.testing.assert_allclose(moment.positions, store.position_um(k), rtol=1e-6, atol=1e-6)  # float32
            np.testing.assert_allclose(moment.dimensions, [*store.box(k)[1], 90, 90, 90], rtol=1e-6)
            assert moment.time == store.times_us[k]
            assert moment.data["step"] == store.steps[k]


def test_mdanalysis_dump_reader_moves_the_origin_to_the_box_corner(slurry):
    """Its coordinates start at the corner of each frame's own box: in a shrinking box that adds a motion."""
    with read_frames(slurry / "frames.h5") as store:
        universe = MDAnalysis.Universe.empty(len(store.particles), trajectory=True)
        universe.load_new(str(slurry / "dump.lammpstrj"), format="LAMMPSDUMP", lammps_coordinate_convention="unwrapped")
        assert len(universe.trajectory) == 121
        for k, moment in enumerate(universe.trajectory):
            lower_um, _ = store.box(k)
            np.testing.assert_allclose(moment.positions + lower_um, store.position_um(k), rtol=0, atol=2e-6)
        shift_um = store.position_um(0) - store.position_um(120)
        universe.trajectory[0]
        moved_um = universe.atoms.positions - shift_um
        universe.trajectory[120]
        assert np.abs(moved_um - universe.atoms.positions).min() > 0.2


@pytest.mark.parametrize(
    ("edit", "says"),
    [
        (lambda frames: frames[:-1], "ends after frame 119, the run has 121 frames"),
        (lambda frames: [*frames[:60], *frames[61:]], "frame 60 is step 3050 in place of step 3000"),
        (lambda frames: frames[1:], "frame 0 is step 50 in place of step 0"),
        (lambda frames: [*frames, frames[-1]], "frame 121, line "),
        (lambda frames: [*frames[:60], frames[60][:-40]], "frame 60, line "),
        (lambda frames: [], "holds no frame"),
        (lambda frames: [frame.replace("\n1 1 0.55 ", "\n1 2 0.55 ") for frame in frames], "particles of the types"),
        (lambda frames: [frame.replace("\n1 1 0.55 ", "\n1 1 0.56 ") for frame in frames], "radii differ"),
    ],
    ids=["cut", "missing", "start missing", "twice", "truncated", "empty", "other type", "other radius"],
)
def test_extract_frames_refuses_a_dump_that_is_not_the_whole_run(tmp_path, slurry, command, edit, says):
    frames = ["ITEM: TIMESTEP" + text for text in (slurry / "dump.lammpstrj").read_text().split("ITEM: TIMESTEP")[1:]]
    (tmp_path / "dump").write_text("".join(edit(frames)))
    paths = {"dump": tmp_path / "dump", "inputs": slurry / "inputs.json", "run": slurry / "run.json"}
    words = command("extract_frames", **paths, frames=tmp_path / "frames.h5", cost=tmp_path / "cost.json")
    result = subprocess.run(words, capture_output=True, text=True)
    assert result.returncode == 1
    assert result.stderr.startswith(f"error: {tmp_path / 'dump'}: ")
    assert says in result.stderr
    assert result.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["dump"]
