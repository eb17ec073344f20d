"""Relax a predicted microstructure in LAMMPS: overlaps pushed off, then a fixed number of DEM steps under pressure.

The steps are those of the slurry's DEM, but for a barostat of their own and a thermostat whose set point falls from a
start value to that of the DEM: with the latter alone the particles are too slow to find their places in so few steps.

In: the wrapped prediction (LAMMPS data file, um), the pair coefficients and inputs of its slurry, the prediction itself
(HDF5, for what the particles are).
Out: the relaxed microstructure as LAMMPS data file and as a frame store of one frame (HDF5). Its attributes hold the
state at the end: temperature_k and temperature_rotational_k, pressure_kpa, and kinetic_share, the kinetic energy over
pressure x volume; and densification, the density over that of the prediction.
"""

import json
import shutil
from pathlib import Path

import numpy as np

from slurrycast.data.frames import read_frames, write_frames
from slurrycast.dem.lammps_dump import as_frame, read_dump
from slurrycast.dem.lammps_run import Launcher, Progress, force_field_variables, run_lammps
from slurrycast.dem.particles import total_volume_um3
from slurrycast.dem.relaxation import check_slurry, end_state, explained, start_temperature_k
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import RunError, moved_into_place
from slurrycast.runtime.work_folder import work_folder


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--wrapped", "LAMMPS data file of the wrapped prediction")
    parser.add_input("--predicted", "predicted microstructure, HDF5")
    parser.add_input("--inputs", "JSON of generate_inputs.py")
    parser.add_input("--coefficients", "pair_coeff lines of the real forces")
    parser.add_input("--push-off", "pair_coeff lines of the soft push-off")
    parser.add_value(
        "--settings",
        "JSON: steps, pressure_damping_steps, start_thermal_share, push_off_iterations",
        type=json.loads,
    )
    parser.add_value("--work", "work folder; kept with the logs if LAMMPS fails", type=Path)
    parser.add_lammps()
    parser.add_output("--relaxed-data", "LAMMPS data file")
    parser.add_output("--relaxed", "relaxed microstructure, HDF5")
    parser.add_output("--cost", "cost record, JSON")


def main(args: Namespace) -> None:
    """Relax and write."""
    inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
    steps, dem = args.settings["steps"], inputs["physics"]["dem"]
    variables = {
        **force_field_variables(inputs["physics"]),
        "steps": steps,
        "push_off_iterations": args.settings["push_off_iterations"],
        "pressure_damping_us": args.settings["pressure_damping_steps"] * dem["timestep_us"],
        "start_temperature_k": start_temperature_k(inputs, args.settings["start_thermal_share"]),
        "data": "wrapped.data",
        "coefficients": "coefficients.lmp",
        "push_off": "push_off.lmp",
        "velocity_seed": inputs["seeds"]["relaxation"],
        "thermo_every_steps": max(1, steps // 10),
    }
    launcher = Launcher(args.executable, args.launcher, args.ranks)
    with read_frames(args.predicted) as store, work_folder(args.work) as folder:
        check_slurry(store, inputs)
        work = folder.path
        slurry, surrogate = (str(store.attributes[name]) for name in ("slurry", "surrogate"))
        with measured_cost(args.cost, "relax_slurry", surrogate, slurry) as cost:
            for name, source in (
                ("wrapped.data", args.wrapped),
                ("coefficients.lmp", args.coefficients),
                ("push_off.lmp", args.push_off),
            ):
                shutil.copyfile(source, work / name)
            progress = Progress(f"{slurry} relaxation", 0, steps, print)
            volume_before_um3 = np.prod(store.box(store.last)[1])
            pushed = run_lammps(launcher, "push_off.lmp", variables, work, "push_off.log")
            try:
                log = run_lammps(launcher, "relax.lmp", variables, work, "relax.log", progress)
            except RunError as error:
                packing_fraction = total_volume_um3(store.particles) / volume_before_um3
                raise explained(error, pushed, slurry, packing_fraction) from error
            (dump,) = read_dump(work / "relaxed.dump")
            frame = as_frame(dump, store.last, dem["timestep_us"])
            volume_um3 = np.prod(frame.edges_um)
            attributes = {
                **store.attributes,
                "stage": "relaxed",
                "relaxation": json.dumps(args.settings),
                "lammps_version": log.version,
                "densification": float(volume_before_um3 / volume_um3),
                **end_state(log, "Press"),
            }
            write_frames(args.relaxed, store.particles, [frame], attributes)
            with moved_into_place(args.relaxed_data) as part:
                shutil.copyfile(work / "relaxed.data", part)
            cost.particles, cost.steps = len(store.particles), steps
    with read_frames(args.relaxed) as relaxed:
        print(f"[{slurry}] {surrogate}: relaxed to {relaxed.density_g_cm3(relaxed.last):.4f} g/cm3")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
