"""Shared by all tests: the package beside the scripts, where the project's files are, and one small slurry."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pandas as pd
import pytest
import yaml

from configurations import ROOT
from slurrycast.dem.lammps_run import force_field_variables
from slurrycast.runtime.environment import isolate_libraries, remove

# Tests touch repositories of their own only, whichever a hook of git names, and obey no settings of the user.
remove(os.environ, "GIT_*")
os.environ |= {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1"}
isolate_libraries(os.environ)
os.environ["PYTHONPATH"] = str(ROOT / "scripts")  # of scripts that tests call: the package of this checkout
# Whichever test starts TensorFlow: sums over several threads come out in another order from run to run.
os.environ |= {"TF_NUM_INTRAOP_THREADS": "1", "TF_NUM_INTEROP_THREADS": "1"}

INPUT_FILES = {
    "data": "initial.data",
    "coefficients": "coefficients.lmp",
    "push_off": "push_off.lmp",
    "inputs": "inputs.json",
}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Start whole workflows first, as they take longest, where several processes share the tests."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


@pytest.fixture
def root() -> Path:
    """The project folder."""
    return ROOT


@pytest.fixture
def history() -> pd.DataFrame:
    """Learning curves of three epochs, the second one the best."""
    losses = {"loss": [3, 1, 0.4], "mae": [2, 1, 0.5], "val_loss": [2.5, 0.9, 1], "val_mae": [1.5, 0.8, 0.9]}
    return pd.DataFrame({"epoch": [1, 2, 3]} | losses)


@pytest.fixture(scope="session", autouse=True)
def programs_on_path() -> Iterator[None]:
    """Let lmp and mpiexec of this environment be found, whether it is activated or not."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
        yield


@pytest.fixture(scope="session")
def command() -> Callable[..., list[str]]:
    """Command line of a script: command("run_slurry", last_frame=10, ...)."""

    def build(script: str, **options: object) -> list[str]:
        (path,) = ROOT.glob(f"scripts/*/{script}.py")
        words = [sys.executable, str(path)]
        for name, value in options.items():
            words += [f"--{name.replace('_', '-')}", *map(str, value if isinstance(value, list) else [value])]
        return words

    return build


@pytest.fixture(scope="session")
def generate(command) -> Callable[..., None]:
    """Write the inputs of a slurry with some physics into a folder."""

    def run(folder: Path, physics: dict, slurry: str = "A") -> None:
        files = {name: folder / file for name, file in INPUT_FILES.items()} | {"cost": folder / "cost.json"}
        subprocess.run(command("generate_inputs", slurry=slurry, physics=json.dumps(physics), **files), check=True)

    return run


@pytest.fixture(scope="session")
def dem_command(command) -> Callable[..., list[str]]:
    """Command line of run_slurry.py with the inputs of one folder and outputs, and the work folder, in another."""

    def build(inputs: Path, outputs: Path, last_frame: int, restart_frames: Sequence[int] = (1, 10, 60)) -> list[str]:
        files = {name: inputs / file for name, file in INPUT_FILES.items()}
        files |= {"dump": outputs / "dump.lammpstrj", "log": outputs / "lammps.log", "thermo": outputs / "thermo.csv"}
        files |= {"run": outputs / "run.json", "cost": outputs / "run_cost.json", "restarts": outputs}
        folders = {"work": outputs / "work", "attempts": outputs / "attempts"}
        kept = [frame for frame in restart_frames if frame <= last_frame]
        return command("run_slurry", **files, **folders, last_frame=last_frame, restart_frames=kept)

    return build


@pytest.fixture(scope="session")
def slurry(tmp_path_factory, command, generate, dem_command) -> Path:
    """Folder of a slurry of some 80 particles that went through the DEM: 121 frames, one every 50 steps."""
    folder = tmp_path_factory.mktemp("a slurry")
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())
    dem = {"steps": 6000, "segment_frames": 40, "thermo_every_steps": 50}
    physics = {
        "formulation": config["formulation"] | {"unit_mass_pg": 100.0},
        "force_field": config["force_field"],
        "dem": config["dem"] | dem | {"pressure_damping_us": 2.0},
        "slurry": {"mass_units": 1.0, "thickness_ratio": 1.2, "seed": 7},
    }
    generate(folder, physics)
    subprocess.run(dem_command(folder, folder, 120), check=True)
    files = {"inputs": "inputs.json", "run": "run.json", "frames": "frames.h5", "cost": "cost.json", "work": "work"}
    paths = {name: folder / file for name, file in files.items()}
    subprocess.run(command("extract_frames", dump=folder / "dump.lammpstrj", **paths), check=True)
    return folder


@pytest.fixture(scope="session")
def variables(slurry) -> dict[str, object]:
    """The -var settings of the slurry, but for the steps of a segment."""
    inputs = json.loads((slurry / "inputs.json").read_text())
    dem = inputs["physics"]["dem"]
    return {
        **force_field_variables(inputs["physics"]),
        "data": "initial.data",
        "coefficients": "coefficients.lmp",
        "push_off": "push_off.lmp",
        "push_off_iterations": dem["push_off_iterations"],
        "velocity_seed": inputs["seeds"]["velocities"],
        "thermo_every_steps": 50,
        "frame_every_steps": 50,
    }
