"""Relax random starts and affine maps of the validation slurries with other settings, beside the end of their DEM.

    make .venv/installed-test
    .venv/bin/snakemake --cores 2 slurries --configfile results/reference/relaxation/replicas.yaml
    PATH=.venv/bin:$PATH python results/reference/relaxation/measure_relaxations.py results/relaxation_replicas \
        results/reference/relaxation/settings.csv

V1 and V2 of config/config.yaml. Their DEM runs differ in their seeds alone; each relaxation starts from another one of
them (`affine`), or from other random places (`direct`). One setting at a time differs from those of config/config.yaml.
Takes ten minutes.
Out: CSV of start, slurry, seed, the setting that differs and its value, and what was measured at the end; `dem` in the
column start are the DEM runs themselves.
"""

import json
import os
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import pandas as pd
import yaml

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "scripts"), *(str(ROOT / "scripts" / stage) for stage in ("surrogate", "hybrid"))]
import predict_slurry  # noqa: E402
import relax_slurry  # noqa: E402
import wrap_slurry  # noqa: E402
from slurrycast.analysis.structure import structure_measures  # noqa: E402
from slurrycast.data.frames import FrameStore, read_frames  # noqa: E402
from slurrycast.runtime.command_line import Parser  # noqa: E402

MEASURES = ("density_g_cm3", "coordination_all", "share_below_4_contacts", "overlap_mean")
END_STATE = ("temperature_k", "kinetic_share", "pressure_kpa")
LAST_INPUT, TARGET = 10, 120
VARIATIONS = {
    "none": [None],
    "steps": [600, 1200, 1800, 2400, 4500],
    "start_thermal_share": [1.0e-7, 1.0e-5, 1.0e-4, 1.0e-3],
    "pressure_damping_steps": [1500, 5000],
    "packing_fraction": [0.4, 0.5, 0.6],
}


def call(module: object, **options: object) -> None:
    """Run a script in this process."""
    parser = Parser(module.__doc__)
    module.add_options(parser)
    words = []
    for name, value in options.items():
        words += [f"--{name.replace('_', '-')}", str(value)]
    module.main(parser.parse_args(words))


def measured(store: FrameStore, frame: int) -> dict:
    """What is compared of one structure."""
    measures = structure_measures(store.position_um(frame), *store.box(frame), store.particles)
    return {"particles": len(store.particles)} | {name: measures[name] for name in MEASURES}


def relaxed(results: Path, run: str, start: str, settings: Mapping, packing_fraction: float) -> dict:
    """Predict, wrap and relax one slurry, and measure the end."""
    dem = results / "dem" / run
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "packing.json").write_text(json.dumps({"mean": packing_fraction}))
        files = {"predicted": folder / "predicted.h5", "cost": folder / "cost.json", "inputs": dem / "inputs.json"}
        own = (
            {"packing": folder / "packing.json", "frames": results / "frames" / f"{run}.h5"}
            if start == "affine"
            else {}
        )
        surrogate = {"settings": json.dumps({"packing_fraction": packing_fraction}), "target_frame": TARGET}
        call(predict_slurry, surrogate=start, input_frames=LAST_INPUT, **surrogate, **files, **own)
        call(wrap_slurry, wrapped=folder / "wrapped.data", **files)
        dem_files = {"coefficients": dem / "coefficients.lmp", "push_off": dem / "push_off.lmp"}
        outputs = {"relaxed_data": folder / "relaxed.data", "relaxed": folder / "relaxed.h5", "work": folder / "work"}
        options = files | dem_files | outputs | {"wrapped": folder / "wrapped.data"}
        before_s = os.times().children_user + os.times().children_system
        call(relax_slurry, settings=json.dumps(settings), **options)
        lammps_s = os.times().children_user + os.times().children_system - before_s
        with read_frames(folder / "relaxed.h5") as store:
            ends = {name: store.attributes[name] for name in END_STATE}
            return measured(store, TARGET) | ends | {"lammps_cpu_s": lammps_s}


def rows(results: Path) -> Iterator[dict]:
    """Rows of the table."""
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    default = config["relaxation"]
    loose = config["surrogate"]["direct"]["packing_fraction"]
    runs = {path.stem: path for path in sorted((results / "frames").glob("V*.h5"))}
    dense = []
    for run, path in runs.items():
        slurry, _, seed = run.partition("_")
        with read_frames(path) as store:
            ends = measured(store, TARGET)
            measures = structure_measures(store.position_um(TARGET), *store.box(TARGET), store.particles)
        dense.append(measures["packing_nominal"])
        yield {"start": "dem", "slurry": slurry, "seed": seed, "setting": "none"} | ends
    for start in ("direct", "affine"):
        for setting, values in VARIATIONS.items():
            if start == "affine" and setting == "packing_fraction":
                continue
            for value in values:
                packing_fraction = sum(dense) / len(dense) if start == "affine" else loose
                settings = dict(default)
                if setting == "packing_fraction":
                    packing_fraction = value
                elif value is not None:
                    settings[setting] = value
                for run in runs:
                    slurry, _, seed = run.partition("_")
                    names = {"start": start, "slurry": slurry, "seed": seed, "setting": setting, "value": value}
                    yield names | relaxed(results, run, start, settings, packing_fraction)


def main() -> None:
    """Measure all and write the table, row by row."""
    results, path = Path(sys.argv[1]), Path(sys.argv[2])
    table = []
    for row in rows(results):
        table.append(row)
        pd.DataFrame(table).to_csv(path, index=False, float_format="%.6g")


if __name__ == "__main__":
    main()
