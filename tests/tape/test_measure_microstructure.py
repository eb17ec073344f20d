"""measure_microstructure.py on the small slurry of a real DEM."""

import json
from pathlib import Path
from subprocess import CompletedProcess

import h5py
import numpy as np
import pandas as pd
import pytest

from script_runs import run_script
from slurrycast.analysis.microstructure import MOST_PARTICLES, void_tortuosity
from slurrycast.analysis.structure import structure_measures
from slurrycast.data.frames import read_frames, write_frames
from slurrycast.data.tables import read_table
from slurrycast.runtime.costs import read_cost
from structures import frame, particles

OUTPUTS = {
    "table": "table.csv",
    "profile": "z.csv",
    "pores": "pores.csv",
    "properties": "cell.json",
    "voxels": "image.h5",
    "cost": "cost.json",
}


def measure(slurry: Path, folder: Path, **options: object) -> CompletedProcess:
    """Run the script on the slurry with all outputs in a folder."""
    inputs = {"structure": slurry / "frames.h5", "inputs": slurry / "inputs.json"}
    outputs = {name: folder / file for name, file in OUTPUTS.items()}
    return run_script("measure_microstructure", **inputs | outputs | options)


@pytest.fixture(scope="module")
def measured(slurry, tmp_path_factory) -> Path:
    """Folder of the outputs of a slurry, a quarter of whose organics is solvent."""
    folder = tmp_path_factory.mktemp("measured")
    done = measure(slurry, folder, solvent_mass_fraction=0.25, tortuosity_spacings_um=[0.1, 0.125])
    assert done.returncode == 0, done.stderr
    return folder


def test_quantities(slurry, measured):
    table = read_table(measured / "table.csv")
    assert list(table.columns) == ["source", "slurry", "stage", "quantity", "value", "unit"]
    assert {(row.source, row.slurry, row.stage) for row in table.itertuples()} == {("dem", "A", "slurry")}
    assert table.quantity.is_unique
    value, unit = (table.set_index("quantity")[name] for name in ("value", "unit"))
    with read_frames(slurry / "frames.h5") as store:
        some, (lower_um, edges_um) = store.particles, store.box(store.last)
        expected = structure_measures(store.position_um(store.last), lower_um, edges_um, some)
    volume_um3, organics, number = np.prod(edges_um), some.in_phase("BDPD"), {}
    for name in some.phase_names:
        number[name] = some.in_phase(name).sum()
    for name in [name for name in expected if name.startswith("coordination_")]:
        assert value[name] == pytest.approx(expected[name], rel=1e-8)
    assert value.density == pytest.approx(expected["density_g_cm3"], rel=1e-8)
    dry_pg = some.mass_pg[~organics].sum() + 0.75 * some.mass_pg[organics].sum()
    assert value.green_density == pytest.approx(dry_pg / volume_um3, rel=1e-8)
    # The same contacts, counted for each particle and for the volume.
    between = number["NiO"] * expected["coordination_NiO-8YSZ"] / volume_um3
    same = sum(number[name] * expected[f"coordination_{name}-{name}"] / 2 for name in ("NiO", "8YSZ")) / volume_um3
    assert value["contacts_NiO-8YSZ"] == pytest.approx(between, rel=1e-8)
    assert value.contacts_ceramic == pytest.approx(between + same, rel=1e-8)
    for kind in ("nominal", "union"):
        assert 1 - value[f"share_void_{kind}"] == pytest.approx(expected[f"packing_{kind}"], rel=1e-8)
        shares = value[[f"share_{name}_{kind}" for name in ("NiO", "8YSZ", "organic", "void")]]
        assert shares.sum() == pytest.approx(1, abs=1e-8)
    assert value.share_ceramic_union < value.share_ceramic_filled < value.share_ceramic_nominal
    assert value.share_nonceramic_filled == pytest.approx(1 - value.share_ceramic_filled)
    assert 0 <= value.percolation_NiO_z <= 1
    assert 0.1 < value.pore_size_d10 < value.pore_size_mean < value.pore_size_d90 < 2
    assert (value[["tortuosity_z_0.1um", "tortuosity_z_0.125um"]] > 1.2).all()
    assert unit[["density", "contacts_ceramic", "pore_size_mean", "share_void_union"]].tolist() == [
        "g/cm3", "1/um3", "um", "1",
    ]  # fmt: skip
    assert read_cost(measured / "cost.json").particles == len(some)


def test_profile_and_image_agree(measured):
    value = read_table(measured / "table.csv").set_index("quantity").value
    profile = read_table(measured / "z.csv")
    with h5py.File(measured / "image.h5") as file:
        image, names = file["phase"][:], list(file["phase"].attrs["codes"])
    assert names == ["void", "BDPD", "NiO", "8YSZ"]
    for code, name in enumerate(names):
        shares = profile[profile.phase == name].share
        np.testing.assert_allclose(shares, np.mean(image == code, axis=(0, 1)), rtol=1e-8)
    assert np.mean(image == 0) == pytest.approx(value.share_void_union, abs=0.01)


def test_what_models_of_cells_ask_for(slurry, measured):
    value = read_table(measured / "table.csv").set_index("quantity").value
    cell = json.loads((measured / "cell.json").read_text())
    with read_frames(slurry / "frames.h5") as store:
        some = store.particles
    number = {name: some.in_phase(name).sum() for name in ("NiO", "8YSZ")}
    assert cell["porosity"] == pytest.approx(value.share_void_union, rel=1e-8)
    assert cell["porosity_without_organics"] == pytest.approx(value.share_nonceramic_filled, rel=1e-8)
    assert cell["volume_shares"]["NiO"] == pytest.approx(value.share_NiO_union, rel=1e-8)
    of_ceramic = cell["shares_of_ceramic_volume"]
    assert of_ceramic.keys() == number.keys() and sum(of_ceramic.values()) == pytest.approx(1, abs=1e-12)
    assert of_ceramic["NiO"] / of_ceramic["8YSZ"] == pytest.approx(value.share_NiO_union / value.share_8YSZ_union)
    assert cell["coordination"]["NiO-8YSZ"] == pytest.approx(value["coordination_NiO-8YSZ"], rel=1e-8)
    among = sum(value[f"coordination_{name}-{name}"] * number[name] for name in number)
    between = 2 * value["coordination_NiO-8YSZ"] * number["NiO"]
    expected = (among + between) / sum(number.values())
    assert cell["coordination"]["ceramic"] == pytest.approx(expected, rel=1e-8)
    assert cell["mean_radius_um"]["BDPD"] == pytest.approx(0.55)
    assert cell["pore_diameter_um"].keys() == {"mean", "d10", "d90"} and cell["pore_diameter_voxel_um"] == 0.1
    factors = cell["tortuosity_factor_of_void"]
    assert factors == pytest.approx({f"z_{h}um": value[f"tortuosity_z_{h}um"] for h in ("0.1", "0.125")}, rel=1e-8)
    assert (cell["tortuosity_factor_without_organics"], cell["thickness_um"]) == ({}, None)


def test_a_tape_has_the_thickness_that_its_cast_film_gives_it(slurry, tmp_path):
    tape, outputs = tmp_path / "dried.h5", tmp_path / "measured"
    outputs.mkdir()
    with read_frames(slurry / "frames.h5") as store:
        attributes = store.attributes | {"slurry_thickness_um": 8.0, "tape_thickness_um": 6.0}
        write_frames(tape, store.particles, [store.frame(store.last)], attributes)
    options = {"wet_thickness_um": 100, "spacing_um": 0.3, "tortuosity_spacings_um": [0.3, 0.4]}
    options |= {"tortuosity_of": ["nonceramic", "void"], "tortuosity_axes": ["x", "z"]}
    done = measure(slurry, outputs, structure=tape, **options)
    assert done.returncode == 0, done.stderr
    value = read_table(outputs / "table.csv").set_index("quantity").value
    cell = json.loads((outputs / "cell.json").read_text())
    assert [value.shrinkage, value.thickness, cell["thickness_um"]] == pytest.approx([0.25, 75, 75])
    for name, start in (("of_void", "tortuosity"), ("without_organics", "tortuosity_nonceramic")):
        found = {key: value[f"{start}_{key}"] for key in ("x_0.3um", "x_0.4um", "z_0.3um", "z_0.4um")}
        factors = pd.Series(cell[f"tortuosity_factor_{name}"], dtype=float)
        assert dict(factors) == pytest.approx(found, rel=1e-8, nan_ok=True)


@pytest.mark.parametrize(
    ("options", "code", "line"),
    [
        ({"organic": "PVB"}, 1, "organic phase PVB: the particles are of BDPD, NiO, 8YSZ"),
        ({"solvent_mass_fraction": 1.1}, 2, "--solvent-mass-fraction: 1.1: must be 0 to 1"),
        ({"solvent_mass_fraction": "nan"}, 2, "nan: must be 0 to 1"),
        ({"tortuosity_spacings_um": [0.2, 0.0005]}, 2, "--tortuosity-spacings-um: 0.0005: must be 0.001 to 5"),
        (
            {"tortuosity_spacings_um": [0.2, 0.1], "tortuosity_extrapolated": []},
            2,
            "--tortuosity-extrapolated needs 3 --tortuosity-spacings-um or more",
        ),
        ({"tortuosity_axes": "xy"}, 2, "--tortuosity-axes: invalid choice: 'xy'"),
        ({"tortuosity_of": ["void", "BDPD"]}, 2, "--tortuosity-of: invalid choice: 'BDPD'"),
        ({"spacing_um": "x"}, 2, "--spacing-um: x: must be 0.001 to 5"),
    ],
)
def test_bad_options_get_one_line(slurry, tmp_path, options, code, line):
    done = measure(slurry, tmp_path, **options)
    assert done.returncode == code
    assert line in done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.glob("*.*"))


@pytest.mark.parametrize("axis", "xyz")
def test_of_a_large_structure_the_middle_layer_is_taken(monkeypatch, axis):
    # A wall with a hole in the middle of the height, and open space elsewhere.
    edges_um = np.array([2.0, 2.0, 9.0])
    x, y = (places.ravel() for places in np.mgrid[0.125:2:0.25, 0.125:2:0.25])
    wall_um = np.stack([x, y, np.full(len(x), 4.5)], axis=1)[8:] - edges_um / 2
    some = particles(np.ones(len(wall_um), dtype=int), 0.2)
    turned = np.roll(range(3), "xyz".index(axis) - 2)
    across = frame(0, wall_um[:, turned], edges_um[turned])
    whole = void_tortuosity(across, some, 0.1, axis)
    monkeypatch.setattr("slurrycast.analysis.microstructure.MOST_PARTICLES", len(wall_um) // 3)
    layer = void_tortuosity(across, some, 0.1, axis)
    assert MOST_PARTICLES == 10_000
    assert layer > 1.2 * whole > 1.2
