"""LAMMPS data files: against a golden file of a small recipe, and read back by a parser of another project."""

import json
from pathlib import Path

import MDAnalysis
import numpy as np
import pytest

from configurations import load
from data_files import atoms, bounds_um
from formulations import phase
from slurrycast.dem.lammps_data import write_data
from slurrycast.dem.recipe import ParticleType

GOLDEN = Path(__file__).parent / "golden" / "initial.data"
TYPES = [
    ParticleType(1, "A", 1, 1, 1.1, 0.8135, 0.3, 1.0),
    ParticleType(2, "B", 2, 1, 0.6, 6.67, 0.7, 0.5),
    ParticleType(3, "B", 2, 2, 1 / 3, 6.67, 0.7, 0.5),
]
PHYSICS = {
    "formulation": {
        "unit_mass_pg": 8.0,
        "initial_packing_fraction": 0.25,
        "phases": {"A": phase(0.3, 0.8135, {1.1: 1.0}), "B": phase(0.7, 6.67, {0.6: 0.25, 0.4: 0.75})},
    },
    "force_field": load("config")["force_field"],
    "slurry": {"mass_units": 2.0, "thickness_ratio": 1.5, "seed": 42},
}


@pytest.fixture(scope="module")
def generated(tmp_path_factory, generate) -> Path:
    """Folder with what generate_inputs.py writes for the slurry."""
    folder = tmp_path_factory.mktemp("generated")
    generate(folder, PHYSICS, "G")
    return folder


def test_generated_data_match_the_golden_file(generated):
    """Words must be equal, numbers to a few units in the last place: cube roots differ between processors."""
    lines, golden = (path.read_text().split("\n") for path in (generated / "initial.data", GOLDEN))
    for line, expected in zip(lines, golden, strict=True):
        for word, wanted in zip(line.split(), expected.split(), strict=True):
            assert word == wanted or float(word) == pytest.approx(float(wanted), rel=1e-13)


def test_same_seed_gives_the_same_files_and_another_seed_other_positions(generated, tmp_path, generate):
    for seed, same in ((42, True), (43, False)):
        generate(tmp_path, PHYSICS | {"slurry": PHYSICS["slurry"] | {"seed": seed}}, "G")
        assert ((tmp_path / "initial.data").read_bytes() == (generated / "initial.data").read_bytes()) is same
        assert (tmp_path / "coefficients.lmp").read_bytes() == (generated / "coefficients.lmp").read_bytes()


def test_inputs_say_what_was_reached(generated):
    inputs = json.loads((generated / "inputs.json").read_text())
    assert inputs["physics"] == PHYSICS
    assert [t["type"] for t in inputs["types"]] == [1, 2, 3]
    assert sum(t["particles"] for t in inputs["types"]) == inputs["particles"]
    mass_pg = {"A": 0.0, "B": 0.0}
    for t in inputs["types"]:
        mass_pg[t["phase"]] += t["particles"] * t["density_g_cm3"] * np.pi / 6 * t["diameter_um"] ** 3
    assert inputs["mass_pg"] == pytest.approx(sum(mass_pg.values()))
    shares = {phase: mass / sum(mass_pg.values()) for phase, mass in mass_pg.items()}
    assert inputs["mass_fractions_reached"] == pytest.approx(shares)
    assert len(set(inputs["seeds"].values())) == 3


def test_box_is_centred_and_holds_the_packing_asked_for(generated):
    inputs = json.loads((generated / "inputs.json").read_text())
    bounds = bounds_um(generated / "initial.data")
    edges_um = bounds[:, 1] - bounds[:, 0]
    assert bounds.sum(axis=1) == pytest.approx(0, abs=1e-12)
    assert edges_um / edges_um[0] == pytest.approx([1, 1, 1.5])
    particles_um3 = sum(t["particles"] * np.pi / 6 * t["diameter_um"] ** 3 for t in inputs["types"])
    assert particles_um3 / edges_um.prod() == pytest.approx(0.25)


@pytest.fixture
def written(tmp_path) -> tuple[Path, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A file of random particles, with their types, positions, and the box."""
    rng = np.random.default_rng(1)
    lower_um, edges_um = np.array([-1 / 3, -2.0, 1e-3]), np.array([2 / 3, np.pi, 7.0])
    position_um, kinds = lower_um + rng.random((50, 3)) * edges_um, rng.integers(1, 4, 50)
    write_data(tmp_path / "x.data", "slurry X", TYPES, kinds, position_um, lower_um, edges_um)
    return tmp_path / "x.data", kinds, position_um, lower_um, edges_um


def test_numbers_read_back_the_same(written):
    path, kinds, position_um, lower_um, edges_um = written
    np.testing.assert_array_equal(bounds_um(path), np.column_stack([lower_um, lower_um + edges_um]))
    rows = atoms(path)
    np.testing.assert_array_equal(rows[:, 0], np.arange(1, 51))
    np.testing.assert_array_equal(rows[:, 1], kinds)
    np.testing.assert_array_equal(rows[:, 2], [TYPES[kind - 1].diameter_um for kind in kinds])
    np.testing.assert_array_equal(rows[:, 3], [TYPES[kind - 1].density_g_cm3 for kind in kinds])
    np.testing.assert_array_equal(rows[:, 4:], position_um)


def test_mdanalysis_reads_the_same(written):
    path, kinds, position_um, _, edges_um = written
    universe = MDAnalysis.Universe(str(path), atom_style="id type diameter density x y z")
    assert [int(kind) for kind in universe.atoms.types] == kinds.tolist()
    assert universe.dimensions[:3] == pytest.approx(edges_um)
    # Its box starts at the origin, and so do its coordinates in releases that shift them.
    shift = universe.atoms.positions - position_um
    assert shift == pytest.approx(np.broadcast_to(shift[0], shift.shape), abs=1e-5)
