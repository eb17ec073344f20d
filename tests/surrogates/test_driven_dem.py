"""The DEM continued while its box is driven: it ends in the box asked for, keeps its contacts, particles collide."""

from dataclasses import replace

import numpy as np
import pytest

from slurrycast.data.frames import read_frames
from slurrycast.dem.lammps_log import read_log
from slurrycast.runtime.files import RunError
from slurrycast.surrogates.driven_dem import DrivenDem
from slurrycast.surrogates.prediction import PredictionInput

FIRST, TARGET = 10, 120


@pytest.fixture
def prediction_input(slurry, continuation_input):
    """An input that ends at frame 10, with the final box given by edges, or that of the target frame."""

    def build(edges_um=None):
        if edges_um is None:
            with read_frames(slurry / "frames.h5") as store:
                edges_um = store.frame(TARGET).edges_um
        return continuation_input(FIRST, edges_um)

    return build


def moved_um(position_um: np.ndarray, asked: PredictionInput) -> np.ndarray:
    """Displacement (n, 3) from the affine map, without that of the whole slurry."""
    moved = position_um - asked.last.position_um / asked.last.edges_um * asked.final_edges_um
    return moved - moved.mean(axis=0)


def largest_overlap(scaled: np.ndarray, asked: PredictionInput) -> float:
    """Of all pairs in the final box, as a share of the sum of their radii."""
    apart = scaled[:, None] - scaled
    distance_um = np.linalg.norm((apart - np.round(apart)) * asked.final_edges_um, axis=2)
    touch_um = asked.particles.radius_um[:, None] + asked.particles.radius_um
    return float(np.max(np.where(np.eye(len(scaled)), 0, 1 - distance_um / touch_um)))


def test_ends_near_the_dem_without_the_overlaps_of_the_affine_map(prediction_input, slurry):
    asked = prediction_input()
    position_um = DrivenDem().predict(asked, None, {"steps": 1000}).position_um
    affine = asked.last.position_um / asked.last.edges_um
    assert largest_overlap(position_um / asked.final_edges_um, asked) < 0.5 * largest_overlap(affine, asked)
    with read_frames(slurry / "frames.h5") as store:
        true_um = moved_um(store.frame(TARGET).position_um, asked)
    assert np.mean((moved_um(position_um, asked) - true_um) ** 2) < 0.8 * np.mean(true_um**2)


@pytest.mark.parametrize("shape", [(1, 1, 1), (0.99, 1.01, 1.02)])
def test_box_follows_the_square_of_the_time_that_is_left(prediction_input, shape):
    """To the box asked for, of whatever shape."""
    asked = prediction_input(prediction_input().final_edges_um * shape)
    DrivenDem().predict(asked, None, {"steps": 500})
    thermo = read_log(asked.continuation.work / "drive.log").thermo
    left = (thermo[:, -3:] - asked.final_edges_um) / (asked.last.edges_um - asked.final_edges_um)
    expected = (1 - thermo[:, 0] / 500) ** 2
    assert thermo[:, 0].tolist() == list(range(0, 501, 50))
    np.testing.assert_allclose(left, np.broadcast_to(expected[:, None], left.shape), atol=1e-6)
    np.testing.assert_allclose(thermo[-1, -3:], asked.final_edges_um, rtol=1e-9)


def test_lost_contact_history_is_an_error(prediction_input, lose_contact_history):
    asked = prediction_input()
    DrivenDem().predict(asked, None, {"steps": 10})
    lose_contact_history("drive.lmp")
    with pytest.raises(RunError, match="dropped a part of the restart file"):
        DrivenDem().predict(asked, None, {"steps": 10})


def test_another_box_than_asked_for_is_an_error(prediction_input, monkeypatch):
    """Nothing that LAMMPS is known to do; were it to, the prediction would be scaled without a word."""
    from slurrycast.dem import lammps_dump

    asked = prediction_input()
    read_dump = lammps_dump.read_dump

    def larger(path):
        for frame in read_dump(path):
            frame.edges_um[:] *= 1.01
            yield frame

    monkeypatch.setattr(lammps_dump, "read_dump", larger)
    with pytest.raises(RunError, match=r"^A: driven to a box of .* in place of .*drive\.log$"):
        DrivenDem().predict(asked, None, {"steps": 10})


def test_the_same_last_frame_gets_the_same_prediction(prediction_input):
    asked = prediction_input()
    every, last = (
        DrivenDem().predict(replace(asked, frames=frames), None, {"steps": 50}).position_um
        for frames in (asked.frames, asked.frames[-1:])
    )
    np.testing.assert_array_equal(every, last)
