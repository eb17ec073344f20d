"""One drying in LAMMPS, from a structure in a frame store to the tape."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from slurrycast.data.frames import Frame, FrameStore, Particles
from slurrycast.dem.drying import dry_force_field, drying_types, stage_commands
from slurrycast.dem.forcefield import coefficients
from slurrycast.dem.lammps_dump import as_frame, read_dump
from slurrycast.dem.lammps_log import Log
from slurrycast.dem.lammps_run import Launcher, Progress, force_field_variables, run_lammps
from slurrycast.dem.particles import particles_of, total_volume_um3
from slurrycast.dem.recipe import derived_seed, particle_types
from slurrycast.dem.relaxation import check_slurry, start_temperature_k, write_wrapped
from slurrycast.runtime.files import write_text


@dataclass(frozen=True)
class Tape:
    """What is left of a slurry, in the work folder also as dried.data.

    Attributes
    ----------
    frame, particles
        The tape.
    rows
        Of the slurry, of the end of each stage and of the end of the rest: step, solvent_left, thickness_um of the box,
        density_g_cm3, packing_fraction, pressure_kpa along z, kinetic_share.
    log
        That of dry.lmp.
    seed
        Of the velocities.
    steps
        Of the whole drying.
    """

    frame: Frame
    particles: Particles
    rows: list[dict]
    log: Log
    seed: int
    steps: int


def dry(
    store: FrameStore, inputs: Mapping, settings: Mapping, launcher: Launcher, work: Path, say: Callable[[str], None]
) -> Tape:
    """Dry the last frame of a store.

    Parameters
    ----------
    store
        The slurry.
    inputs
        Content of inputs.json.
    settings
        Section drying of the configuration, with pressure_damping_steps and start_thermal_share of section relaxation.
    launcher, work, say
        How LAMMPS is started, its folder, and what takes the lines of its progress.

    Raises
    ------
    InputError
        If the inputs are those of another slurry.
    RunError
        If LAMMPS fails.
    """
    check_slurry(store, inputs)
    wet = particle_types(inputs["physics"]["formulation"]["phases"])
    force_field = dry_force_field(inputs["physics"]["force_field"], settings["force_field"])
    timestep_us = settings["timestep_factor"] * inputs["physics"]["dem"]["timestep_us"]
    damping = {"timestep_us": timestep_us, "pressure_damping_us": settings["pressure_damping_steps"] * timestep_us}
    physics = inputs["physics"] | {"force_field": force_field, "dem": inputs["physics"]["dem"] | damping}
    seed = derived_seed(inputs["physics"]["slurry"]["seed"], "drying")
    stages, last = settings["stages"], settings["stages"] * settings["steps_per_stage"] + settings["rest_steps"]
    variables = {
        **force_field_variables(physics),
        "stages": stages,
        "steps_per_stage": settings["steps_per_stage"],
        "rest_steps": settings["rest_steps"],
        "start_temperature_k": start_temperature_k(inputs, settings["start_thermal_share"]),
        "velocity_seed": seed,
        "thermo_every_steps": max(1, last // 100),
    }
    solvent_left = [1 - stage / stages for stage in range(stages + 1)]
    types = [drying_types(wet, settings, share) for share in solvent_left]
    slurry = store.attributes["slurry"]
    write_wrapped(work / "slurry.data", f"slurry {slurry} to be dried", wet, store)
    write_text(work / "coefficients.lmp", coefficients(wet, force_field))
    for stage in range(1, stages + 1):
        path = work / f"stage_{stage:0{len(str(stages))}}.lmp"
        write_text(path, stage_commands(types[stage], settings["phase"], force_field))
    log = run_lammps(launcher, "dry.lmp", variables, work, "dry.log", Progress(f"{slurry} drying", 0, last, say))
    (dump,) = read_dump(work / "dried.dump")
    frame = as_frame(dump, store.last, timestep_us)
    id, type = (frame_column.astype(int) for frame_column in dump.values[:, :2].T)
    rows = []
    states = zip([*solvent_left, 0.0], [*types, types[-1]], np.loadtxt(work / "rows.txt"), strict=True)
    for share, types_then, (step, thickness_um, pressure_kpa, kinetic_share) in states:
        particles = particles_of([asdict(t) for t in types_then], id, type)
        volume_um3 = frame.edges_um[0] * frame.edges_um[1] * thickness_um
        rows.append(
            {
                "step": int(step),
                "solvent_left": share,
                "thickness_um": thickness_um,
                "density_g_cm3": float(particles.mass_pg.sum() / volume_um3),
                "packing_fraction": total_volume_um3(particles) / volume_um3,
                "pressure_kpa": pressure_kpa,
                "kinetic_share": kinetic_share,
            }
        )
    return Tape(frame, particles, rows, log, seed, last)
