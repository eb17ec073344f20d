"""A run with its tables, as small as a report takes it."""

import json
import zipfile

import h5py
import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imsave

from configurations import load, merged
from slurrycast.evaluation.speedup import HYBRID_PARTS
from slurrycast.report.network_table import read_network
from slurrycast.report.results import Results

PHASES = {"NiO": (0.6, 6.67, 0.6), "BDPD": (0.4, 0.8, 1.1)}  # mass fraction, g/cm3, um
CONFIG = merged(
    load("config"),
    {
        "run": {"name": "unit"},
        "formulation": {"unit_mass_pg": 100.0},
        "dem": {"steps": 1200},
        "surrogate": {"names": ["affine", "net"], "net": {"epochs": 3, "batch_size": 10, "learning_rate": 1e-4}},
        "relaxation": {"steps": 50},
    },
)
CONFIG["formulation"]["phases"] = {
    name: {"mass_fraction": mass_fraction, "density_g_cm3": density_g_cm3}
    | {"size_classes": [{"diameter_um": diameter_um, "number_fraction": 1.0}]}
    for name, (mass_fraction, density_g_cm3, diameter_um) in PHASES.items()
}


@pytest.fixture
def model(tmp_path):
    """A .keras file with one convolution and one dense layer."""
    same = {"padding": "same"}
    relu = same | {"activation": "relu"}
    layers = [
        ("InputLayer", {"batch_shape": [None, 3, 2]}),
        ("Conv1D", {"filters": 5, "kernel_size": [3], "strides": [1], "use_bias": True} | relu),
        ("MaxPooling1D", {"pool_size": [2], "strides": [2]} | same),
        ("Flatten", {}),
        ("Dense", {"units": 3, "activation": "linear", "use_bias": True}),
        ("Unknown", {}),
    ]
    path, weights = tmp_path / "model.keras", tmp_path / "weights.h5"
    shapes = {"layers/conv1d/vars/0": (3, 2, 5), "layers/conv1d/vars/1": 5, "layers/dense/vars/0": (10, 3)}
    shapes |= {"layers/dense/vars/1": 3, "optimizer/vars/0": 999}
    with h5py.File(weights, "w") as file:
        for name, shape in shapes.items():
            file[name] = np.zeros(shape)
    with zipfile.ZipFile(path, "w") as archive:
        config = {"config": {"layers": [{"class_name": kind, "config": settings} for kind, settings in layers]}}
        archive.writestr("config.json", json.dumps(config))
        archive.write(weights, "model.weights.h5")
    return path


def speedup_table(surrogates: tuple[str, ...]) -> pd.DataFrame:
    """Hybrid runs of 20 s, three fifths of it relaxation; slurry 6 is not in equilibrium, N1 has no full DEM."""
    parts = dict.fromkeys(HYBRID_PARTS, 0.5) | {"relax_slurry": 12.0}
    parts["run_slurry_to_input"] = 8.0 - 0.5 * (len(HYBRID_PARTS) - 2)
    dem = {"2": (100.0, 20.0), "6": (100.0, np.nan), "N1": (np.nan, np.nan)}
    rows = [
        {"surrogate": name, "slurry": slurry, "clock": clock, "particles": 100}
        | parts
        | {"hybrid": 20.0, "dem": full, "dem_to_equilibrium": early, "ratio": full / 20}
        | {"ratio_to_equilibrium": early / 20, "hybrid_to_tape": np.nan}
        for clock in ("wall_s", "cpu_s")
        for name in surrogates
        for slurry, (full, early) in dem.items()
    ]
    return pd.DataFrame(rows)


@pytest.fixture
def results(tmp_path, model, history) -> Results:
    """A run of two surrogates with a training slurry, two of role test, of which "6" is the worst, and a new one."""
    roles = {"T1": "train", "2": "test", "6": "test", "N1": "new"}
    surrogates = ("affine", "net")
    equilibrium = pd.DataFrame(
        {
            "slurry": list(roles),
            "role": list(roles.values()),
            "mass_units": [1.0, 1.0, 5.0, 1.0],
            "thickness_ratio": 2.0,
            "particles": [100, 100, 500, 100],
            "density_g_cm3": [2.24, 2.24, 2.1, 1.0],
            "mean_contacts": 6.0,
            "density_drift": [0.0001, 0.0002, 0.01, np.nan],
            "time_to_equilibrium_us": [1.2, 1.2, 2.3, np.nan],
            "temperature_densifying_k": [62000.0, 62000.0, 108000.4, 75000.0],
            "temperature_k": [860.0, 860.0, 190.0, 62000.0],
            "temperature_rotational_k": [10.0, 10.0, 80.0, 300.0],
            "kinetic_share": [2.5e-7, 2.5e-7, 1.2e-7, 1e-5],
            "run_time_us": [2.4, 2.4, 2.4, 0.2],
            "warning": ["", "", "density drifts by <1 %> & more", ""],
        }
    )
    ends = [(700.0, 40.0, 101.3, 2e-7), (900.0, 20.0, 101.9, 3e-7), (800.0, 30.0, 103.9, 1e-3)]
    end_state = ("temperature_k", "temperature_rotational_k", "pressure_kpa")
    relaxation_ends = pd.DataFrame(
        [
            (name, slurry, 50, *end, np.nan)
            for name in surrogates
            for slurry, end in zip(("2", "6", "N1"), ends, strict=True)
        ],
        columns=["surrogate", "slurry", "steps", *end_state, "kinetic_share", "warning"],
    ).astype({"warning": object})
    hybrid = {
        "net": {"2": (2.2512, 44.4), "6": (2.31, 216.4), "N1": (2.2345, 44.7)},
        "affine": {"2": (2.2624, 44.2), "6": (2.163, 231.1), "N1": (2.2222, 45.0)},
    }
    of_dem = {"T1": (2.24, 44.6), "2": (2.24, 44.6), "6": (2.1, 238.1)}
    density = pd.DataFrame(
        [
            (name, slurry, "DEM" if name == "-" else "hybrid", *values)
            for name, by_slurry in ({"-": of_dem} | hybrid).items()
            for slurry, values in by_slurry.items()
        ],
        columns=["surrogate", "slurry", "model", "density_g_cm3", "volume_um3"],
    )
    values = {"2": (100, 1.5), "6": (500, 1.4), "N1": (100, 1.5)}
    training_range = pd.DataFrame(
        [
            (slurry, roles[slurry], "this run", *row)
            for slurry, (particles, density_g_cm3) in values.items()
            for row in (
                ("particles", particles, 100.0, 100.0, "yes" if slurry == "6" else "no"),
                ("density_g_cm3", density_g_cm3, 1.45, 1.55, "yes" if slurry == "6" else "no"),
                ("fraction_NiO", 0.61, 0.6, 0.6, "no"),
            )
        ],
        columns=["slurry", "role", "model", "quantity", "value", "training_min", "training_max", "outside"],
    )
    measures = ("mse_um2", "mae_um", "r2")
    coordinate_errors = pd.DataFrame(
        [
            (name, slurry, axis, factor * mse, 0.25, r2, 0.5 * factor * mse, 0.2, r2)
            for name, factor in (("affine", 2.0), ("net", 1.0))
            for slurry, mse, r2 in (("2", 0.1234, 0.9876), ("6", 0.4321, 0.9543))
            for axis in ("x", "y", "z", "all")
        ],
        columns=["surrogate", "slurry", "axis", *measures, *(f"{name}_true_box" for name in measures)],
    )
    rdf_errors = pd.DataFrame(
        [
            (name, slurry, pair, 2.1, 36, difference)
            for name, difference in (("affine", 0.0317), ("net", 0.0217))
            for slurry in ("2", "6")
            for pair in ("all", "NiO-8YSZ")
        ],
        columns=["surrogate", "slurry", "pair", "r_max_um", "bins", "mean_abs_difference"],
    )
    costs = [("train_surrogate", "net", "-", 30.0)]
    for slurry, role in roles.items():
        costs += [
            ("run_slurry", "-", slurry, 100.0 if role != "new" else 10.0),
            ("run_slurry_to_input", "-", slurry, 5.0),
        ]
        if role != "train":
            hybrid = (("predict_slurry", 2.0), ("wrap_slurry", 0.5), ("relax_slurry", 12.0))
            costs += [(stage, name, slurry, wall_s) for name in surrogates for stage, wall_s in hybrid]
            costs += [("generate_inputs", "-", slurry, 0.25), ("extract_frames", "-", slurry, 0.25)]
    costs = pd.DataFrame(costs, columns=["stage", "surrogate", "slurry", "wall_s"])
    costs = costs.assign(cpu_s=costs.wall_s, max_rss_mb=100.0)
    segments = [{"step_start": 0, "step_end": 600, "wall_s": 20.0, "cpu_s": 20.0}]
    segments += [{"step_start": 600, "step_end": 1200, "wall_s": 80.0, "cpu_s": 80.0}]
    start = {"wall_s": 0.0, "cpu_s": 0.0}
    run = {"start": start, "segments": segments, "steps": 1200, "lammps_version": "22 Jul 2025"}
    figures = {}
    for stem in ("workflow", "learning_curves_net", "coordinates_2", "slurry_net_N1", "density", "rdf", "costs"):
        figures[stem] = tmp_path / f"{stem}.png"
        imsave(figures[stem], np.random.default_rng(0).random((20, 30, 3)))
    return Results(
        config=CONFIG,
        config_text="run: {name: unit}",
        versions={"python": "3.11.7", "packages": {"keras": "3.15.1"}},
        roles=roles,
        formulations=dict.fromkeys(roles, ""),
        expected_g_cm3=dict.fromkeys(roles, CONFIG["formulation"]["expected_density_g_cm3"]),
        inputs={
            row.slurry: {
                "mass_fractions_reached": {"NiO": 0.601, "BDPD": 0.399},
                "physics": {"slurry": {"mass_units": row.mass_units}, "formulation": CONFIG["formulation"]},
                "types": [{"particles": row.particles - 40}, {"particles": 40}],
            }
            for row in equilibrium.itertuples()
        },
        runs=dict.fromkeys(roles, run),
        density=density,
        coordinate_errors=coordinate_errors,
        rdf_errors=rdf_errors,
        equilibrium=equilibrium,
        relaxation_ends=relaxation_ends,
        microstructure=None,
        drying_ends=None,
        drying_calibration=None,
        training_range=training_range,
        costs=costs,
        speedup=speedup_table(surrogates),
        surrogates=surrogates,
        left_out=[],
        descriptions={name: (f"all that {name} may see", "last frame") for name in surrogates},
        histories={"net": history},
        networks={"net": read_network(model)},
        weights_of={"net": "lowest"},
        figures=figures,
    )
