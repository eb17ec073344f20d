"""measure_structure.py on the small slurry of a real DEM."""

from subprocess import CompletedProcess

import numpy as np
import pytest

from script_runs import run_script
from slurrycast.analysis.rdf import bin_centres_um, bin_edges_um, radial_distributions
from slurrycast.data.frames import read_frames, write_frames
from slurrycast.data.tables import read_table

CUTOFF_UM, BINS = 7.0, 120
PAIRS = ["all", "BDPD-BDPD", "BDPD-NiO", "BDPD-8YSZ", "NiO-NiO", "NiO-8YSZ", "8YSZ-8YSZ"]
COORDINATION = [f"coordination_{pair}" for pair in PAIRS]
OVERLAP_AND_PACKING = ["overlap_mean", "overlap_max", "packing_nominal", "packing_union"]
COARSENESS = [f"coarseness_2um_{phase}" for phase in ("BDPD", "NiO", "8YSZ")]
QUANTITIES = ["particles", "density_g_cm3", *COORDINATION, "share_below_4_contacts", *OVERLAP_AND_PACKING, *COARSENESS]


@pytest.fixture
def measure(tmp_path):
    """Run the script with these inputs; return the finished run and the paths of its tables."""

    def start(**inputs: object) -> tuple[CompletedProcess, list]:
        outputs = {name: tmp_path / f"{name}.csv" for name in ("structure", "rdf")}
        done = run_script("measure_structure", **inputs, **outputs, cutoff_um=CUTOFF_UM, bins=BINS)
        return done, list(outputs.values())

    return start


@pytest.fixture
def hybrid(slurry, tmp_path) -> dict:
    """The DEM's frame 60 as the predicted, and its frame 120 as the relaxed structure of a surrogate."""
    with read_frames(slurry / "frames.h5") as store:
        for stage, k in (("predicted", 60), ("relaxed", 120)):
            origin = {"slurry": "007", "surrogate": "affine_f02"}
            write_frames(tmp_path / f"{stage}.h5", store.particles, [store.frame(k)], origin)
    return {stage: tmp_path / f"{stage}.h5" for stage in ("predicted", "relaxed")}


def test_target_structure(slurry, measure, tmp_path):
    process, tables = measure(dem=slurry / "frames.h5", target_frame=120)
    assert process.returncode == 0, process.stderr
    structure, curves = map(read_table, tables)
    assert list(structure.columns) == ["surrogate", "slurry", "stage", "quantity", "value"]
    assert list(structure.quantity) == QUANTITIES
    assert list(curves.columns) == ["surrogate", "slurry", "stage", "pair", "r_um", "g"]
    assert list(curves.pair.unique()) == PAIRS
    for table in (structure, curves):
        assert {tuple(row) for row in table[["surrogate", "slurry", "stage"]].values} == {("-", "A", "target")}
    value = structure.set_index("quantity").value
    with read_frames(slurry / "frames.h5") as store:
        assert value.coordination_all == pytest.approx(store.coordination(120).mean(), rel=1e-8)
        assert value.density_g_cm3 == pytest.approx(store.density_g_cm3(120), rel=1e-8)
        r_edges_um = bin_edges_um(CUTOFF_UM, BINS, [store.box(120)[1]])
        g = radial_distributions(store.position_um(120), *store.box(120), store.particles, r_edges_um)
    assert 0 < value.overlap_mean < value.overlap_max < 0.2
    assert 0.3 < value.packing_union < value.packing_nominal < 0.8
    for pair in PAIRS:
        curve = curves[curves.pair == pair]
        np.testing.assert_allclose(curve.r_um, bin_centres_um(r_edges_um), rtol=1e-8)
        np.testing.assert_allclose(curve.g, g[pair], rtol=1e-8)


def test_predicted_and_relaxed_structures_each_in_its_own_box(slurry, measure, hybrid, tmp_path):
    process, tables = measure(**hybrid)
    assert process.returncode == 0, process.stderr
    structure, curves = map(read_table, tables)
    for table in (structure, curves):
        assert set(table.surrogate) == {"affine_f02"}
        assert set(table.slurry) == {"007"}
        assert list(table.stage.unique()) == ["predicted", "relaxed"]
    density = structure[structure.quantity == "density_g_cm3"].value.to_numpy()
    with read_frames(slurry / "frames.h5") as store:
        np.testing.assert_allclose(density, [store.density_g_cm3(k) for k in (60, 120)], rtol=1e-8)
        for stage, k in (("predicted", 60), ("relaxed", 120)):
            bins = len(bin_edges_um(CUTOFF_UM, BINS, [store.box(k)[1]])) - 1
            assert len(curves[curves.stage == stage]) == bins * len(PAIRS)


@pytest.mark.parametrize(
    "inputs",
    [{}, {"dem": "a"}, {"dem": "a", "target_frame": 1, "relaxed": "b"}, {"predicted": "a"}, {"relaxed": "b"}],
)
def test_other_mixes_of_inputs_are_refused(slurry, measure, inputs):
    files = {name: slurry / "frames.h5" if value in ("a", "b") else value for name, value in inputs.items()}
    done, _ = measure(**files)
    assert done.returncode == 2
    assert "either --dem and --target-frame, or --predicted and --relaxed are needed" in done.stderr


def test_a_frame_that_is_not_there_is_named(slurry, measure):
    process, _ = measure(dem=slurry / "frames.h5", target_frame=500)
    assert process.returncode == 1
    assert "frame 500 is not in the file, which holds frames 0 to 120" in process.stderr
