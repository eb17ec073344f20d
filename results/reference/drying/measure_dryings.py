"""Dry validation slurries with one setting at a time that differs from config/config.yaml.

    make .venv/installed-test
    .venv/bin/snakemake --cores 2 slurries --configfile results/reference/relaxation/replicas.yaml
    PATH=.venv/bin:$PATH python results/reference/drying/measure_dryings.py results/relaxation_replicas \
        results/reference/drying/settings.csv

V1 (600 particles, six seeds) and V2 (3,001, four seeds) of config/config.yaml, from the end of their DEM. With another
number of stages or another time step, all take the same time as before. The dryings take ten minutes of CPU time; rows
that the table has already are not made again.
Out: CSV of slurry, particles, the setting that differs and its value, and what was measured of the tape:
green density, void and ceramic share (of the union of the spheres), contacts of a particle, thickness over that of the
slurry, kinetic_share at the end, and CPU seconds of LAMMPS.
"""

import json
import os
import sys
import tempfile
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path

import pandas as pd
import yaml

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "scripts"))
from slurrycast.analysis.microstructure import microstructure  # noqa: E402
from slurrycast.data.frames import FrameStore, read_frames  # noqa: E402
from slurrycast.dem.drying_run import dry  # noqa: E402
from slurrycast.dem.lammps_run import Launcher  # noqa: E402

MEASURES = {
    "green_density_g_cm3": "green_density",
    "void": "share_void_union",
    "ceramic_share": "share_ceramic_union",
    "coordination": "coordination_all",
}
VOXEL_UM = 0.5  # of an image that is not used
VARIATIONS: list[tuple[str, float | None]] = [
    ("none", None),
    ("steps_per_stage", 1000),
    ("steps_per_stage", 2000),
    ("timestep_factor", 0.375),
    *(("friction", value) for value in (0.015, 12.5)),
    *(("attraction_factor", value) for value in (0.5, 2.0, 10.0)),
    *(("stages", value) for value in (10, 40)),
    ("rest_steps", 6000),
]
DRYINGS = {"V1": VARIATIONS, "V2": VARIATIONS[:2]}  # the larger slurry with few of them


def varied(default: Mapping, setting: str, value: float | None) -> dict:
    """Settings of a drying of which one differs. The time of all stages, and all times of a finer step, stay."""
    settings = default | {"force_field": dict(default["force_field"])}
    if setting in settings["force_field"]:
        settings["force_field"][setting] = value
    elif setting != "none":
        settings[setting] = value
    if setting == "stages":
        settings["steps_per_stage"] = default["steps_per_stage"] * default["stages"] // value
    if setting == "timestep_factor":
        for steps in ("steps_per_stage", "rest_steps", "pressure_damping_steps"):
            settings[steps] = round(default[steps] * default[setting] / value)
    return settings


def dried(store: FrameStore, inputs: Mapping, settings: Mapping, launcher: Launcher) -> dict:
    """Dry one slurry and measure its tape."""
    with tempfile.TemporaryDirectory() as folder:
        before_s = os.times().children_user + os.times().children_system
        tape = dry(store, inputs, settings, launcher, Path(folder), lambda line: None)
        cpu_s = os.times().children_user + os.times().children_system - before_s
    quantities, _, _ = microstructure(tape.frame, tape.particles, settings["phase"], 0.0, VOXEL_UM)
    first, last = tape.rows[0], tape.rows[-1]
    return {name: quantities[quantity][0] for name, quantity in MEASURES.items()} | {
        "thickness_ratio": last["thickness_um"] / first["thickness_um"],
        "kinetic_share": last["kinetic_share"],
        "cpu_s": cpu_s,
    }


def rows(results: Path, made: set[tuple]) -> Iterator[dict]:
    """Rows of the table but for those that were made."""
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    shared = ("pressure_damping_steps", "start_thermal_share")
    default = config["drying"] | {name: config["relaxation"][name] for name in shared}
    launcher = Launcher(config["dem"]["executable"], config["dem"]["launcher"], 1)
    for slurry, variations in DRYINGS.items():
        for (setting, value), path in product(variations, sorted((results / "frames").glob(f"{slurry}_*.h5"))):
            inputs = json.loads((results / "dem" / path.stem / "inputs.json").read_text(encoding="utf-8"))
            names = {"slurry": path.stem, "particles": inputs["particles"], "setting": setting, "value": value}
            if key(names) in made:
                continue
            with read_frames(path) as store:
                tape = dried(store, inputs, varied(default, setting, value), launcher)
            yield names | tape


def key(row: Mapping) -> tuple:
    """What names a row."""
    value = row["value"]
    return row["slurry"], row["setting"], None if pd.isna(value) else value


def main() -> None:
    """Measure all and write the table, row by row."""
    results, path = Path(sys.argv[1]), Path(sys.argv[2])
    table = pd.read_csv(path).to_dict("records") if path.exists() else []
    for row in rows(results, {key(row) for row in table}):
        table.append(row)
        pd.DataFrame(table).to_csv(path, index=False, float_format="%.6g")


if __name__ == "__main__":
    main()
