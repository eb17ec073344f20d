"""Frames of whole slurries, as a surrogate learns from them."""

from dataclasses import replace

import numpy as np
import pytest

from slurrycast.data.frames import read_frames, write_frames
from slurrycast.data.trajectories import read_trajectories
from slurrycast.runtime.files import InputError

PHASES = ["BDPD", "NiO", "8YSZ"]


def test_frames_are_those_of_the_store(slurry):
    one, other = read_trajectories([slurry / "frames.h5"] * 2, lambda _: [120, 7], PHASES)
    assert one.slurry == other.slurry == "A"
    assert list(one.frames) == [7, 120]
    with read_frames(slurry / "frames.h5") as store:
        np.testing.assert_array_equal(one.frames[120].position_um, store.position_um(120))
        assert list(one.edges_um) == store.frame_numbers.tolist()
        np.testing.assert_array_equal(one.edges_um[7], store.frame(7).edges_um)
        np.testing.assert_array_equal(one.particles.radius_um, store.particles.radius_um)


def test_frame_that_is_not_there_is_refused(slurry):
    with pytest.raises(InputError, match=r"frames\.h5: frame 121 is not in the file"):
        read_trajectories([slurry / "frames.h5"], lambda _: [7, 121], PHASES)


def test_other_phases_are_refused(slurry, tmp_path):
    with read_frames(slurry / "frames.h5") as store:
        other = replace(store.particles, phase_names=("BDPD", "NiO", "GDC"))
        write_frames(tmp_path / "other.h5", other, [store.frame(7)], store.attributes)
    paths = [slurry / "frames.h5", tmp_path / "other.h5"]
    with pytest.raises(InputError, match=r"other\.h5: phase GDC: must be one of BDPD, NiO, 8YSZ"):
        read_trajectories(paths, lambda _: [7], PHASES)


def test_a_phase_has_one_number_in_slurries_of_all_recipes(slurry, tmp_path):
    """Where another recipe has its phases in another order, or one that the first one lacks."""
    with read_frames(slurry / "frames.h5") as store:
        own = store.particles
        names = ("GDC", "BDPD", "NiO")  # 8YSZ, the third of the first recipe, is GDC, the first of this one
        moved = replace(own, phase=np.array([0, 2, 3, 1])[own.phase], phase_names=names)
        write_frames(tmp_path / "other.h5", moved, [store.frame(7)], store.attributes)
    paths, phases = [slurry / "frames.h5", tmp_path / "other.h5"], [*PHASES, "GDC"]
    one, other = read_trajectories(paths, lambda _: [7], phases)
    assert one.particles.phase_names == other.particles.phase_names == tuple(phases)
    np.testing.assert_array_equal(one.particles.phase, own.phase)
    np.testing.assert_array_equal(other.particles.phase, np.where(own.phase == 3, 4, own.phase))
