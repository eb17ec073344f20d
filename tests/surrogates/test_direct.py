"""From the recipe alone to a slurry at rest: the prediction by the script, and its relaxation by LAMMPS."""

import json
import subprocess

import numpy as np
import pytest

from configurations import scaled, shipped
from data_files import atoms
from slurrycast.data.frames import read_frames
from slurrycast.dem.relaxation import unrest

DENSITY_G_CM3 = 2.24  # what the recipe is calibrated to
TOLERANCE = 0.03  # of 78 particles, whose scatter is 1.5 %


@pytest.fixture(scope="module")
def inputs(tmp_path_factory, generate):
    """Folder with the inputs of a slurry of 78 particles, larger by a factor, whose DEM is not run."""

    def build(factor: float = 1.0):
        folder = tmp_path_factory.mktemp("inputs")
        config = scaled(shipped("config"), factor)
        formulation = config["formulation"] | {"unit_mass_pg": 100.0 * factor**3}
        row = {"mass_units": 1.0, "thickness_ratio": 1.2, "seed": 7}
        sections = {"formulation": formulation, "force_field": config["force_field"], "dem": config["dem"]}
        generate(folder, sections | {"slurry": row})
        return folder

    return build


def predict_words(command, folder, surrogate, **options) -> list[str]:
    """Command line of a prediction without frames."""
    settings = json.dumps(shipped("config")["surrogate"].get(surrogate, {}))
    files = {"inputs": folder / "inputs.json", "predicted": folder / f"{surrogate}.h5", "cost": folder / "cost.json"}
    options = {"settings": settings, "input_frames": [0], "target_frame": 120} | files | options
    return command("predict_slurry", surrogate=surrogate, **options)


def packing(store) -> float:
    return (4 / 3 * np.pi * store.particles.radius_um**3).sum() / store.volume_um3(store.last)


def test_random_places_in_a_loose_box_or_in_the_final_one(inputs, command, tmp_path):
    folder = inputs()
    (tmp_path / "packing.json").write_text('{"mean": 0.66}')
    subprocess.run(predict_words(command, folder, "direct"), check=True)
    subprocess.run(predict_words(command, folder, "direct_box", packing=tmp_path / "packing.json"), check=True)
    start, dem = atoms(folder / "initial.data"), shipped("config")["dem"]
    with read_frames(folder / "direct.h5") as loose, read_frames(folder / "direct_box.h5") as boxed:
        assert packing(loose) == pytest.approx(
            shipped("config")["surrogate"]["direct"]["packing_fraction"]
        ) and packing(boxed) == pytest.approx(0.66)
        assert loose.attributes["box_rule"] == "loose_packing"
        assert boxed.attributes["box_rule"] == "mean_packing_fraction"
        for store in (loose, boxed):
            np.testing.assert_array_equal(store.particles.type, start[:, 1])
            np.testing.assert_allclose(2 * store.particles.radius_um, start[:, 2])
            assert (store.frame_numbers[0], store.steps[0]) == (120, dem["steps"])
            assert store.times_us[0] == pytest.approx(dem["steps"] * dem["timestep_us"])
        places = loose.scaled_position(120)
        assert ((places >= 0) & (places < 1)).all()
        assert np.abs(places.mean(axis=0) - 0.5).max() < 4 / np.sqrt(12 * len(places))
        lower_um, edges_um = start[:, 4:7].min(axis=0), np.ptp(start[:, 4:7], axis=0)
        assert np.abs(places - (start[:, 4:7] - lower_um) / edges_um).mean() > 0.2  # not the places of the DEM
        assert np.abs(places - boxed.scaled_position(120)).mean() > 0.2


@pytest.mark.parametrize("factor", [0.1, 1.0, 10.0])
def test_relaxation_finds_the_box_whatever_the_size_of_the_particles(inputs, command, factor):
    folder, config = inputs(factor), shipped("config")["relaxation"]
    subprocess.run(predict_words(command, folder, "direct"), check=True)
    files = {name: folder / f"{name}.data" for name in ("wrapped",)}
    files |= {"predicted": folder / "direct.h5", "inputs": folder / "inputs.json", "cost": folder / "cost.json"}
    subprocess.run(command("wrap_slurry", **files), check=True)
    files |= {"coefficients": folder / "coefficients.lmp", "push_off": folder / "push_off.lmp", "work": folder / "work"}
    files |= {"relaxed_data": folder / "relaxed.data", "relaxed": folder / "relaxed.h5"}
    subprocess.run(command("relax_slurry", **files, settings=json.dumps(config)), check=True)
    with read_frames(folder / "relaxed.h5") as store, read_frames(folder / "direct.h5") as loose:
        assert store.attributes["densification"] == pytest.approx(packing(store) / packing(loose))
        assert store.density_g_cm3(120) == pytest.approx(DENSITY_G_CM3, rel=TOLERANCE)
        assert 5.5 < store.coordination(120).mean() < 7.5
        assert unrest(store.attributes, 101.325, config["max_kinetic_share"], 0.02, 300) == []
