"""Shared by the tests of LAMMPS."""

import json

import pytest

from slurrycast.dem.lammps_run import force_field_variables


@pytest.fixture(scope="session")
def variables(slurry) -> dict[str, object]:
    """The -var settings of the slurry, but for the steps of a segment."""
    inputs = json.loads((slurry / "inputs.json").read_text())
    dem = inputs["physics"]["dem"]
    return {
        **force_field_variables(inputs["physics"]["force_field"], dem),
        "data": "initial.data",
        "coefficients": "coefficients.lmp",
        "push_off": "push_off.lmp",
        "push_off_iterations": dem["push_off_iterations"],
        "velocity_seed": inputs["seeds"]["velocities"],
        "thermo_every_steps": 50,
        "frame_every_steps": 50,
    }
