"""The DEM continued with a faster barostat: it comes to rest, keeps its contacts, and says so if it does not."""

import numpy as np
import pytest

from slurrycast.analysis.errors import coordinate_errors
from slurrycast.dem.lammps_log import read_log
from slurrycast.runtime.files import RunError
from slurrycast.surrogates.early_dem import EarlyDem
from slurrycast.surrogates.prediction import PredictionInput

SETTINGS = {"flat_within": 0.002, "flat_steps": 2000, "pressure_within": 0.1, "max_steps": 40000, "faster": "10"}


def steps_used(inputs: PredictionInput) -> int:
    log = read_log(inputs.continuation.work / "continue.log")
    return int(log.thermo[-1, 0]) - inputs.last.step


@pytest.mark.parametrize("frame", [1, 10])
def test_comes_to_rest_at_the_density_of_the_recipe(continuation_input, frame):
    asked = continuation_input(frame)
    prediction = EarlyDem().predict(asked, None, SETTINGS)
    density_g_cm3 = asked.particles.mass_pg.sum() / np.prod(prediction.edges_um)
    assert density_g_cm3 == pytest.approx(2.24, rel=0.03)
    pressure_kpa = read_log(asked.continuation.work / "continue.log").thermo[-1, 3]
    assert pressure_kpa == pytest.approx(101.325, rel=SETTINGS["pressure_within"])
    assert 0 < steps_used(asked) < SETTINGS["max_steps"]
    assert steps_used(asked) % SETTINGS["flat_steps"] == 0
    # isotropic, about the centre of the box
    np.testing.assert_allclose(np.ptp(prediction.edges_um / asked.last.edges_um), 0, atol=1e-9)
    scaled = prediction.position_um / prediction.edges_um
    assert coordinate_errors(asked.last.position_um / asked.last.edges_um, scaled)["all"].r2 > 0.8
    # the contact history goes on
    log = (asked.continuation.work / "continue.log").read_text()
    assert "Resetting global fix info from restart file" in log
    assert "NEIGH_HISTORY" in log
    assert "Unused restart file" not in log


def test_a_box_that_hardly_moves_is_not_taken_for_one_at_rest(continuation_input):
    """In steps so short the density of a run that has just begun changes by less than the bound."""
    asked = continuation_input(1)
    settings = SETTINGS | {"flat_steps": 1, "max_steps": 3, "flat_within": 0.05}
    with pytest.raises(RunError, match=r"^A: not at rest after surrogate.early_dem.max_steps \(3\) more steps: .*kPa"):
        EarlyDem().predict(asked, None, settings)
    thermo = read_log(asked.continuation.work / "continue.log").thermo
    assert abs(thermo[-1, 2] / thermo[0, 2] - 1) < settings["flat_within"]
    assert steps_used(asked) == 3


def test_max_steps_end_a_run_that_is_not_flat(continuation_input):
    asked = continuation_input(10)
    with pytest.raises(RunError, match=r"max_steps \(400\).*density \+.* over the last 200"):
        EarlyDem().predict(asked, None, SETTINGS | {"flat_steps": 200, "max_steps": 500, "flat_within": 1e-9})
    assert steps_used(asked) == 400


def test_lost_contact_history_is_an_error(continuation_input, lose_contact_history):
    lose_contact_history("continue.lmp")
    with pytest.raises(RunError, match="dropped a part of the restart file"):
        EarlyDem().predict(continuation_input(60), None, SETTINGS | {"flat_steps": 1, "max_steps": 1})


@pytest.mark.parametrize(("text", "faster"), [("x2", "2"), ("x32", "32"), ("x0", None), ("x", None), ("10", None)])
def test_variant_names_how_much_faster(text, faster):
    match = EarlyDem.variant.fullmatch(text)
    assert (match and match["faster"]) == faster
