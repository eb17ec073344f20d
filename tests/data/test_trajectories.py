"""Frames of whole slurries, as a surrogate learns from them."""

import numpy as np
import pytest

from slurrycast.data.frames import read_frames, write_frames
from slurrycast.data.trajectories import read_trajectories
from slurrycast.runtime.files import InputError


def test_frames_are_those_of_the_store(slurry):
    one, other = read_trajectories([slurry / "frames.h5"] * 2, lambda _: [120, 7])
    assert one.slurry == other.slurry == "A"
    assert list(one.frames) == [7, 120]
    with read_frames(slurry / "frames.h5") as store:
        np.testing.assert_array_equal(one.frames[120].position_um, store.position_um(120))
        assert list(one.edges_um) == store.frame_numbers.tolist()
        np.testing.assert_array_equal(one.edges_um[7], store.frame(7).edges_um)
        np.testing.assert_array_equal(one.particles.radius_um, store.particles.radius_um)


def test_frame_that_is_not_there_is_refused(slurry):
    with pytest.raises(InputError, match=r"frames\.h5: frame 121 is not in the file"):
        read_trajectories([slurry / "frames.h5"], lambda _: [7, 121])


def test_other_phases_are_refused(slurry, tmp_path):
    from dataclasses import replace

    with read_frames(slurry / "frames.h5") as store:
        other = replace(store.particles, phase_names=("BDPD", "NiO", "GDC"))
        write_frames(tmp_path / "other.h5", other, [store.frame(7)], store.attributes)
    with pytest.raises(InputError, match=r"other\.h5: has the phases BDPD, NiO, GDC, slurry A has BDPD, NiO, 8YSZ"):
        read_trajectories([slurry / "frames.h5", tmp_path / "other.h5"], lambda _: [7])
