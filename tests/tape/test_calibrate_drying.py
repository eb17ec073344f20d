"""The friction for a measured green density: bisection on a known curve, and dryings by LAMMPS."""

import json
import math

import pytest

from script_runs import run_script
from slurrycast.data.tables import read_table
from slurrycast.dem.calibration import bisection
from test_dry_slurry import SETTINGS

ENDS = (0.01, 10.0)


def density(friction: float) -> float:
    return 3.0 - 0.2 * math.log10(friction)


@pytest.mark.parametrize("wanted", [2.85, 3.0, 3.31])
def test_bisection_finds_the_friction_of_a_known_curve(wanted):
    made = list(bisection(density, wanted, ENDS, 1e-4, 30))
    assert [friction for friction, _ in made[:2]] == [10.0, 0.01]
    friction, found = made[-1]
    assert found == density(friction) == pytest.approx(wanted, rel=1e-4)


def test_no_more_dryings_than_asked_for_and_the_nearest_is_last():
    made = list(bisection(density, 3.05, ENDS, 0.0, 6))
    assert len(made) == 6
    errors = [abs(found - 3.05) for _, found in made[2:]]
    assert errors[-1] == min(errors)


@pytest.mark.parametrize(("wanted", "friction"), [(3.4, 0.01), (3.395, 0.01), (3.405, 0.01), (2.8, 10.0)])
def test_an_end_that_is_near_enough_needs_no_more_dryings(wanted, friction):
    made = list(bisection(density, wanted, ENDS, 3e-3, 9))
    assert made[2:] == [(friction, density(friction))]


@pytest.mark.parametrize("wanted", [2.7, 3.5])
def test_a_density_out_of_reach_is_met_by_no_friction(wanted):
    assert list(bisection(density, wanted, ENDS, 1e-4, 9)) == [(10.0, density(10.0)), (0.01, density(0.01))]


@pytest.mark.parametrize(("measured", "dryings"), [(3.1, (3, 4)), (5.0, (2, 2)), (None, (2, 2))])
def test_real_dryings(slurry, tmp_path, measured, dryings):
    files = {"structure": slurry / "frames.h5", "inputs": slurry / "inputs.json", "work": tmp_path / "work"}
    options = files | {"settings": json.dumps(SETTINGS), "table": tmp_path / "calibration.csv"}
    options |= {"cost": tmp_path / "cost.json"}
    given = {"green_density_g_cm3": measured} if measured else {}
    done = run_script("calibrate_drying", **options, **given, dryings=4, tolerance=0.001)
    assert done.returncode == 0, done.stderr
    table = read_table(tmp_path / "calibration.csv")
    assert dryings[0] <= len(table) <= dryings[1]
    assert list(table.friction[:2]) == [12.5, 0.015]
    by_friction = table.sort_values("friction").green_density_g_cm3
    assert by_friction.iloc[0] > by_friction.iloc[-1] + 0.2
    said = f"drying.force_field.friction: {table.friction.iloc[-1]:.4g}"
    assert (said in done.stdout) == (measured == 3.1)
    assert ("a green density of 5 g/cm3 is met by no friction" in done.stderr) == (measured == 5.0)
