"""Inputs of surrogates that continue the DEM."""

import json
from collections.abc import Callable
from importlib import import_module

import numpy as np
import pytest

from slurrycast.data.frames import read_frames
from slurrycast.dem import lammps_run
from slurrycast.dem.lammps_run import Launcher
from slurrycast.runtime.command_line import parse
from slurrycast.surrogates import vgg16
from slurrycast.surrogates.prediction import Continuation, PredictionInput


@pytest.fixture
def run_main(command) -> Callable[..., None]:
    """Run a script in this process, where a test can change what it uses."""

    def run(script: str, **options: object) -> None:
        module = import_module(script)
        module.main(parse(module.add_options, module.__doc__, command(script, **options)[2:]))

    return run


@pytest.fixture
def small(monkeypatch):
    """A network like VGG16 that is built and saved in no time."""
    monkeypatch.setattr(vgg16, "BLOCKS", ((8, 8), (16, 16), (16, 16), (24, 24), (24, 24)))
    monkeypatch.setattr(vgg16, "DENSE_UNITS", 64)
    monkeypatch.setattr(vgg16, "SHARD_UNITS", 16)


@pytest.fixture
def continuation_input(slurry, tmp_path) -> Callable[..., PredictionInput]:
    """An input that ends at a frame, with final edges if there are any."""

    def build(frame: int, final_edges_um: np.ndarray | None = None) -> PredictionInput:
        work = tmp_path / "work folder"
        work.mkdir(exist_ok=True)
        inputs = json.loads((slurry / "inputs.json").read_text())
        restart = slurry / f"frame_{frame}.restart"
        continuation = Continuation(restart, slurry / "coefficients.lmp", inputs, Launcher("lmp", "mpiexec", 1), work)
        with read_frames(slurry / "frames.h5") as store:
            frames = tuple(store.frame(k) for k in range(max(0, frame - 3), frame + 1))
            return PredictionInput("A", store.particles, frames, final_edges_um, continuation)

    return build


@pytest.fixture
def lose_contact_history(monkeypatch, tmp_path) -> Callable[[str], None]:
    """Let a script repeat pair_style, as one would from LAMMPS' examples."""

    def lose(script: str) -> None:
        text = (lammps_run.SCRIPTS / script).read_text()
        repeated = "pair_style hybrid/overlay lj/cut 1.0 ${contact_styles}\n"
        (tmp_path / script).write_text(text.replace("include ", f"{repeated}include ", 1))
        monkeypatch.setattr(lammps_run, "SCRIPTS", tmp_path)

    return lose
