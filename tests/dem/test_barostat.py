"""The barostats of the DEM: Berendsen's clock is its damping time, whatever the number of particles; chains go on."""

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from configurations import scaled, shipped
from slurrycast.config.dem_checks import barostat
from slurrycast.data.tables import read_table
from slurrycast.dem.lammps_log import read_log
from slurrycast.dem.lammps_run import Launcher, force_field_variables, run_lammps
from slurrycast.evaluation.size import SHRUNK_SHARE, shrink_time_us

DAMPING_US = 14.0
SCRIPT_RUNS = {  # further variables of the scripts that continue the DEM from frame 10
    "continue.lmp": {"max_rounds": 1, "round_steps": 20, "flat_within": 1, "pressure_within": 1},
    "drive.lmp": {"steps": 20} | {f"final_l{axis}_um": 4.0 for axis in "xyz"},
    "displace.lmp": {"from": 3000, "displacement_um": 1e-6, "displacement_seed": 1},
}


@pytest.fixture(scope="module")
def shrinking(tmp_path_factory, generate, dem_command):
    """Run the DEM of so many mass units, of about 80 particles each, while its box shrinks; its folder."""

    def build(mass_units: float, scale: float = 1.0, **dem: object) -> Path:
        folder = tmp_path_factory.mktemp("shrinking")
        config = scaled(shipped("config"), scale)
        settings = {"steps": 36000, "segment_frames": 60, "thermo_every_steps": 10, "temperature_k": 300.0 * scale**3}
        physics = {
            "formulation": config["formulation"] | {"unit_mass_pg": 100.0 * scale**3},
            "force_field": config["force_field"],
            "dem": config["dem"] | settings | {"pressure_damping_us": DAMPING_US * scale} | dem,
            "slurry": {"mass_units": mass_units, "thickness_ratio": 1.2, "seed": 7},
        }
        generate(folder, physics)
        subprocess.run(dem_command(folder, folder, 23), check=True)
        return folder

    return build


@pytest.fixture(scope="module")
def slurry(shrinking) -> Path:
    """The smaller one of two slurries under Berendsen's barostat."""
    return shrinking(1.0)


def time_us(folder: Path) -> float:
    thermo = read_table(folder / "thermo.csv")
    return shrink_time_us(thermo.time_us.to_numpy(), thermo.lx_um.to_numpy())


def test_clock_of_berendsen_is_its_damping_time_at_any_size(shrinking, slurry):
    """Without pressure inside, the volume falls by e in the damping time; particles that meet delay it a little."""
    small, large = time_us(slurry), time_us(shrinking(5.0))
    assert large == pytest.approx(small, rel=0.02)
    free = -3 * np.log(SHRUNK_SHARE) * DAMPING_US
    assert free < small < 1.05 * free


def test_clock_of_npt_depends_on_the_number_of_particles(shrinking):
    """LAMMPS' barostat has a chain of thermostats whose mass does not grow with the particles."""
    small, large = (time_us(shrinking(units, barostat="npt", pressure_damping_us=2.0e4)) for units in (1.0, 5.0))
    assert large > 1.2 * small


@pytest.mark.parametrize("scale", [0.1, 3.0, 10.0])
def test_clock_of_berendsen_at_any_size_of_particles(shrinking, slurry, scale):
    assert time_us(shrinking(1.0, scale)) == pytest.approx(scale * time_us(slurry), rel=0.02)


@pytest.mark.parametrize("name", ["berendsen", "npt"])
@pytest.mark.parametrize("scale", [0.1, 1.0, 3.0, 10.0])
def test_damping_that_does_not_suit_the_size_of_particles_is_refused(name, scale):
    """LAMMPS' barostat has a mass that goes with k T, so that large particles fall in and small ones hardly move."""
    config = scaled(shipped("config"), scale)
    config["dem"] |= {"barostat": name} | ({"pressure_damping_us": 2.0e4} if name == "npt" else {})
    refused = [line.partition(":")[0] for line in barostat(config, [])]
    assert bool(refused) == ((name, scale) in [("berendsen", 0.1), ("npt", 0.1), ("npt", 10.0)])
    config["dem"]["pressure_damping_us"] *= scale if name == "berendsen" else scale**2.5
    assert not list(barostat(config, []))


@pytest.mark.parametrize("script", SCRIPT_RUNS)
def test_scripts_that_continue_the_dem_take_over_its_thermostat(slurry, tmp_path, script):
    inputs = json.loads((slurry / "inputs.json").read_text())
    variables = {
        **force_field_variables(inputs["physics"]),
        "restart": slurry / "frame_10.restart",
        "coefficients": slurry / "coefficients.lmp",
        "thermo_every_steps": 10,
    }
    run_lammps(Launcher("lmp", "mpiexec", 1), script, variables | SCRIPT_RUNS[script], tmp_path, "log")
    said = (tmp_path / "log").read_text()
    assert re.search(
        r"Resetting global fix info from restart file:\n +fix style: nvt/sphere, fix ID: thermostat\n", said
    )
    assert "Unused restart file" not in said
    read_log(tmp_path / "log")
