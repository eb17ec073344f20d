"""Noise, skill and structural errors: the scripts run on small made-up results."""

import json
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from script_runs import refusal, run_script, write_costs, written
from slurrycast.analysis.rdf import bin_edges_um, radial_distributions
from slurrycast.analysis.structure import structure_measures
from slurrycast.data.frames import read_frames
from slurrycast.data.tables import read_table
from slurrycast.runtime.costs import Cost
from structures import frame, write_store

EDGES_UM = np.array([6.0, 6.0, 12.0])


@pytest.fixture
def table(tmp_path) -> Path:
    """Where the scripts write."""
    return tmp_path / "tables" / "table.csv"


def structure_files(
    folder: Path, surrogate: str, slurry: str, stages: dict[str, tuple[float, float, int]], particles: int = 1000
) -> list[Path]:
    """Tables of a density and a constant g for each stage: (density, g, number of bins)."""
    structure, curves = [], []
    for stage, (density, g, bins) in stages.items():
        names = {"surrogate": surrogate, "slurry": slurry, "stage": stage}
        structure += [names | {"quantity": "particles", "value": particles}]
        structure += [names | {"quantity": "density_g_cm3", "value": density}]
        curves += [names | {"pair": "all", "r_um": 0.1 * (k + 0.5), "g": g} for k in range(bins)]
    paths = [folder / f"{surrogate}_{slurry}{suffix}.csv" for suffix in ("", "_rdf")]
    for path, rows in zip(paths, (structure, curves), strict=True):
        pd.DataFrame(rows).to_csv(path, index=False)
    return paths


def write_random(path: Path, slurry: str, frame_number: int, shift_um: float, **attributes: str) -> Path:
    """One frame of 90 random places, every other particle moved by +-shift_um along x."""
    position_um = np.random.default_rng(int(slurry)).uniform(-0.5, 0.5, (90, 3)) * EDGES_UM
    position_um[:, 0] += shift_um * (-1) ** np.arange(1, 91)
    return write_store(path, [frame(frame_number, position_um, EDGES_UM)], slurry=slurry, **attributes)


@pytest.fixture
def noise(tmp_path) -> Path:
    """Noise of slurries of 90 and 1000 particles."""
    path = tmp_path / "noise.csv"
    path.write_text(
        "slurry,particles,quantity,runs,mean,sd\n"
        "6,90,density_g_cm3,5,2.25,0.01\n6,90,rdf_all,5,0.3,0.1\n6,90,perturbation_floor_um2,1,0.003,\n"
        "2,1000,density_g_cm3,5,2.25,0.002\n2,1000,rdf_all,5,0.04,0.1\n2,1000,perturbation_floor_um2,1,0.03,\n"
    )
    return path


def test_noise_of_replicas_and_perturbed_run(table, tmp_path):
    replicas = [
        structure_files(tmp_path, "-", f"{slurry}_r{k}", {"target": (density, g, bins)}, particles)
        for slurry, particles in (("6", 90), ("2", 1000))
        for k, (density, g, bins) in enumerate([(2.2, 0, 5), (2.3, 1, 4), (2.1, 3, 5)], 1)
    ]
    frames = [write_random(tmp_path / f"{slurry}.h5", slurry, 120, 0) for slurry in "62"]
    perturbed = [write_random(tmp_path / f"{slurry}_perturbed.h5", slurry, 120, 0.3) for slurry in "62"]
    structure, curves = zip(*replicas, strict=True)
    paths = {"structure": structure, "rdf": curves[::-1], "perturbed": perturbed, "frames": frames}
    rows = written("measure_noise", table, **paths, target_frame=120)
    assert list(rows.columns) == ["slurry", "particles", "quantity", "runs", "mean", "sd"]
    assert list(rows.slurry) == ["6", "6", "2", "2", "6", "2"]
    assert list(rows.particles) == [90, 90, 1000, 1000, 90, 90]
    assert list(rows.quantity) == ["density_g_cm3", "rdf_all"] * 2 + ["perturbation_floor_um2"] * 2
    assert list(rows.runs) == [3, 3, 3, 3, 1, 1]
    # Curves 0, 1, 3 differ by 1, 3 and 2. Moved by 0.3 um along one of three axes: 0.3^2 / 3.
    np.testing.assert_allclose(rows["mean"], [2.2, 2, 2.2, 2, 0.03, 0.03])
    np.testing.assert_allclose(rows.sd, [0.1, 1, 0.1, 1, np.nan, np.nan])


TOO_FEW = "needed are two or more of the same size"


@pytest.mark.parametrize(
    ("particles", "said"),
    [
        ({"6_r1": 1000}, f"slurry 6: replicas of 1000 particles, {TOO_FEW}"),
        ({"6_r1": 1000, "6_r2": 999}, f"slurry 6: replicas of 1000, 999 particles, {TOO_FEW}"),
        ({"6": 1000}, "slurry 6: not a replica, their ids are <slurry>_r<number>"),
    ],
)
def test_noise_needs_two_replicas_of_one_size(table, tmp_path, particles, said):
    store = write_random(tmp_path / "6.h5", "6", 120, 0)
    pairs = [structure_files(tmp_path, "-", name, {"target": (2.2, 1, 5)}, n) for name, n in particles.items()]
    structure, rdf = zip(*pairs, strict=True)
    paths = {"structure": structure, "rdf": rdf, "perturbed": store, "frames": store}
    assert refusal("measure_noise", table, **paths, target_frame=120) == f"error: {said}\n"


@pytest.fixture
def predictions(tmp_path):
    """Write predictions that are off by these shifts, and the DEM of their slurry; return the options for both."""

    def write(shifts_um: dict[tuple[str, str], float]) -> dict:
        predicted, frames = [], []
        for (surrogate, slurry), shift_um in shifts_um.items():
            path = tmp_path / f"{surrogate}_{slurry}.h5"
            predicted.append(write_random(path, slurry, 120, shift_um, surrogate=surrogate))
            frames.append(write_random(tmp_path / f"{slurry}.h5", slurry, 120, 0))
        return {"predicted": predicted, "frames": frames, "target_frame": 120}

    return write


def test_skill(table, predictions, noise):
    # MSE is shift^2 / 3, the floor of the nearest slurry 0.003 um2.
    shifts_um = {("vgg16", "1"): 0.0, ("affine", "1"): 0.3, ("affine_f02", "1"): 0.6, ("exact", "1"): np.sqrt(0.009)}
    shifts_um |= {("affine", "2"): 0.09, ("vgg16", "2"): 0.3}
    rows = written("compute_skill", table, **predictions(shifts_um), noise=noise)
    assert list(rows.columns) == ["surrogate", "slurry", "mse_um2", "mse_affine_um2", "floor_um2", "skill"]
    assert list(zip(rows.surrogate, rows.slurry, strict=True)) == list(shifts_um)
    np.testing.assert_allclose(rows.mse_um2, [0, 0.03, 0.12, 0.003, 0.0027, 0.03], atol=1e-12)
    np.testing.assert_allclose(rows.mse_affine_um2, [0.03, 0.03, 0.03, 0.03, 0.0027, 0.0027])
    np.testing.assert_allclose(rows.floor_um2, 0.003)
    # Affine is nearer than the floor for slurry 2: no skill is defined there.
    np.testing.assert_allclose(rows.skill, [0.03 / 0.027, 0, -0.117 / 0.027 + 1, 1, np.nan, np.nan], atol=1e-8)


def test_skill_needs_the_affine_prediction_of_every_slurry(table, predictions, noise):
    options = predictions({("affine", "1"): 0.3, ("vgg16", "1"): 0.3, ("vgg16", "2"): 0.3})
    assert refusal("compute_skill", table, **options, noise=noise) == (
        "error: --predicted: no affine of slurry 2, which skill is measured against\n"
    )


def test_skill_of_another_slurry_is_refused(table, predictions, noise):
    options = predictions({("affine", "1"): 0.3, ("affine", "2"): 0.3})
    predicted, frames = options["predicted"], options["frames"][::-1]
    assert refusal("compute_skill", table, **options | {"frames": frames}, noise=noise) == (
        f"error: {predicted[0]}: slurry 1, not the particles of {frames[0]}\n"
    )


@pytest.fixture
def replica_curves(tmp_path) -> list[Path]:
    """Curves of two replicas of 6, which differ by 0.3 over 4 bins and not beyond, and of 2, which differ by 0.04."""
    heights = {"6": [0.3] * 4 + [0.0] * 2, "2": [0.04] * 6}
    paths = []
    for slurry, differences in heights.items():
        for k in (0, 1):
            path = structure_files(tmp_path, "-", f"{slurry}_r{k + 1}", {"target": (2.25, 1.0, 6)})[1]
            curves = read_table(path)
            curves.assign(g=curves.g + k * np.array(differences)).to_csv(path, index=False)
            paths.append(path)
    return paths


def test_structural_errors(table, noise, replica_curves, tmp_path):
    dem = [structure_files(tmp_path, "-", s, {"target": (2.25, 1.0, 6)}, n) for s, n in (("1", 90), ("3", 360))]
    stages = {"predicted": (2.0, 0.5, 5), "relaxed": (2.24, 1.25, 8)}
    files = [structure_files(tmp_path, "vgg16", s, stages, n) for s, n in (("3", 360), ("1", 90))]
    for _, path in files:  # the relaxed curve goes off in its sixth bin, which the predicted one does not have
        curves = read_table(path)
        curves.loc[(curves.stage == "relaxed") & (curves.r_um > 0.5), "g"] = 99
        curves.to_csv(path, index=False)
    for path, quantity in ((files[0][0], "coarseness_4um_A"), (dem[1][0], "coarseness_2um_A")):  # of one structure only
        rows = read_table(path)
        pd.concat([rows, rows[-1:].assign(quantity=quantity)]).to_csv(path, index=False)
    (structure, rdf), (dem_structure, dem_rdf) = (zip(*paths, strict=True) for paths in (files, dem))
    compared = {"structure": structure, "rdf": rdf, "dem_structure": dem_structure, "dem_rdf": dem_rdf}
    rows = written("compare_structure", table, **compared, replica_rdf=replica_curves, noise=noise)
    assert list(rows.columns) == ["surrogate", "slurry", "stage", "quantity", "value", "dem_value", "replica_sd"]
    keys = product(["vgg16"], ["3", "1"], ["predicted", "relaxed"], ["density_g_cm3", "rdf_all"])
    assert list(rows.iloc[:, :4].itertuples(index=False, name=None)) == list(keys)
    np.testing.assert_allclose(rows.value, [2.0, 0.5, 2.24, 0.25] * 2)
    np.testing.assert_allclose(rows.dem_value, [2.25, 0] * 4)
    # pooled over both sizes; of the RDF, 0.3 in four of the five bins that are compared: noise.csv has another range
    pooled = [np.sqrt((90 * 0.01**2 + 1000 * 0.002**2) / 2), (90**0.5 * 0.24 + 1000**0.5 * 0.04) / 2]
    sds = [sd / np.sqrt(particles) for particles in (360, 90) for sd in pooled * 2]
    np.testing.assert_allclose(rows.replica_sd, sds, rtol=1e-8)


def test_structural_errors_need_the_dem_its_replicas_and_matching_files(table, noise, tmp_path):
    dem = structure_files(tmp_path, "-", "1", {"target": (2.25, 1.0, 6)})
    one, two = (structure_files(tmp_path, "vgg16", slurry, {"relaxed": (2.0, 0.5, 4)}) for slurry in "12")
    for structure, rdf, said in (
        (two[0], two[1], "slurry 2: no RDF all of the DEM to compare with"),
        (one[0], two[1], f"{two[1]}: not the curves of the structures in {one[0]}"),
        (one[0], one[1], "RDF all: no slurry with the curves of two replicas"),
    ):
        options = {"structure": structure, "rdf": rdf, "dem_structure": dem[0], "dem_rdf": dem[1], "noise": noise}
        assert refusal("compare_structure", table, **options) == f"error: {said}\n"


@pytest.fixture
def relaxations(tmp_path, noise, replica_curves):
    """Options for two relaxations of slurry 1 and the DEM, which is heavier, with a larger g and fewer contacts."""
    stores, costs = [], []
    for steps, shift_um in ((700, 0.0), (300, 0.2)):
        path = tmp_path / f"relaxed-{steps}.h5"
        settings = json.dumps({"steps": steps})
        stores.append(write_random(path, "1", 120, shift_um, surrogate="affine", relaxation=settings))
        costs.append(Cost("relax_slurry", "affine", "1", 90, steps, cpu_s=steps / 100))
    density = 90 * 2.0 / np.prod(EDGES_UM)
    with noise.open("a") as rows:
        rows.write("6,90,coordination_all,5,6.5,0.1\n")
    with read_frames(stores[0]) as store:  # the DEM ends where the longer relaxation does
        contacts = structure_measures(store.position_um(120), *store.box(120), store.particles)["coordination_all"]
        r_edges_um = bin_edges_um(0.6, 6, [EDGES_UM])
        g = radial_distributions(store.position_um(120), *store.box(120), store.particles, r_edges_um)["all"]
    measured, _ = structure_files(tmp_path, "affine", "1", {"predicted": (1.0, 1.0, 6), "relaxed": (1.0, 1.0, 6)}, 90)
    names = {"surrogate": "affine", "slurry": "1", "quantity": "overlap_mean"}
    rows = [names | {"stage": stage, "value": value} for stage, value in (("predicted", 0.03), ("relaxed", 0.01))]
    pd.concat([read_table(measured), pd.DataFrame(rows)]).to_csv(measured, index=False)
    of_dem = structure_files(tmp_path, "-", "1", {"target": (density + 0.015, 1.0, 6)}, 90)
    read_table(of_dem[1]).assign(g=g + 0.1).to_csv(of_dem[1], index=False)
    with of_dem[0].open("a") as rows:
        rows.write(f"-,1,target,coordination_all,{contacts - 0.15}\n")
    options = {"relaxed": stores, "relaxation_costs": write_costs(tmp_path, costs), "structure": measured}
    options |= {"noise": noise, "replica_rdf": replica_curves}
    options |= {"dem_structure": of_dem[0], "dem_rdf": of_dem[1]}
    return options | {"cutoff_um": 0.6, "bins": 6}


def test_relaxations_of_several_lengths(table, relaxations):
    rows = written("compare_relaxation", table, **relaxations)
    columns = ["surrogate", "slurry", "steps", "overlap_mean_predicted", "density_error", "density_in_sd"]
    assert list(rows.columns) == [*columns, "rdf_in_spread", "coordination_in_sd", "cpu_s", "within_band"]
    assert list(rows.slurry) == ["1", "1"]
    assert list(rows.steps) == [300, 700]
    np.testing.assert_allclose(rows.overlap_mean_predicted, 0.03)
    density = 90 * 2.0 / np.prod(EDGES_UM)
    np.testing.assert_allclose(rows.density_error, -0.015 / (density + 0.015), rtol=1e-6)
    sd = np.sqrt((90 * 0.01**2 + 1000 * 0.002**2) / 2 / 90)
    np.testing.assert_allclose(rows.density_in_sd, 0.015 / sd, rtol=1e-6)
    # 0.1 everywhere, over the pooled noise of six bins: 0.3 in four of them, and 0.04 in all
    spread = (0.2 + 0.04 * np.sqrt(1000 / 90)) / 2
    assert rows.rdf_in_spread[1] == pytest.approx(0.1 / spread, rel=1e-6)
    assert rows.rdf_in_spread[0] != pytest.approx(0.1 / spread, rel=1e-3)
    assert rows.coordination_in_sd[1] == pytest.approx(1.5, rel=1e-6)
    assert list(rows.cpu_s) == [3.0, 7.0]
    assert rows.within_band[1]


def test_relaxations_need_their_own_costs_and_the_dem(table, relaxations):
    swapped = relaxations | {"relaxation_costs": relaxations["relaxation_costs"][::-1]}
    said = f"error: {swapped['relaxation_costs'][0]}: not the cost of {relaxations['relaxed'][0]}\n"
    assert refusal("compare_relaxation", table, **swapped) == said
    read_table(relaxations["dem_rdf"]).assign(pair="NiO-NiO").to_csv(relaxations["dem_rdf"], index=False)
    assert refusal("compare_relaxation", table, **relaxations) == (
        "error: slurry 1, DEM: no curve of all particles to compare with\n"
    )


def test_without_held_out_slurries_the_tables_are_empty(table, noise):
    assert written("compare_structure", table, noise=noise).empty
    assert written("compute_skill", table, noise=noise, target_frame=120).empty


@pytest.mark.parametrize(
    ("script", "files", "options", "message"),
    [
        ("compute_skill", {"predicted": "a", "noise": "n"}, {"target_frame": 1}, "1 --predicted but 0 --frames"),
        ("compare_structure", {"structure": "a", "noise": "n"}, {}, "1 --structure but 0 --rdf"),
        (
            "measure_noise",
            {"structure": "a", "rdf": "b", "perturbed": "ab", "frames": "a"},
            {"target_frame": 1},
            "2 --perturbed but 1 --frames",
        ),
    ],
)
def test_lists_that_do_not_match_are_refused(table, tmp_path, script, files, options, message):
    for name in "abn":
        (tmp_path / name).touch()
    files = {option: [tmp_path / name for name in names] for option, names in files.items()}
    done = run_script(script, **files, **options, table=table)
    assert done.returncode == 2
    assert message in done.stderr
