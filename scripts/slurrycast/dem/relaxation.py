"""What relaxing a slurry and drying it have in common: how a structure gets into LAMMPS, its start and its end."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from slurrycast.data.frames import FrameStore
from slurrycast.data.periodic import wrap
from slurrycast.dem.forcefield import thermal_share
from slurrycast.dem.lammps_data import write_data
from slurrycast.dem.lammps_log import Log
from slurrycast.dem.recipe import ParticleType, mean_volume_um3, particle_types
from slurrycast.runtime.files import InputError, RunError

# attributes of a structure at the end of its run
END_STATE = ("temperature_k", "temperature_rotational_k", "pressure_kpa", "kinetic_share")

PUSHED_OFF_FJ = 0.25  # as in push_off.lmp: no particle has that much energy where overlaps are gone


def check_slurry(store: FrameStore, inputs: Mapping) -> None:
    """InputError unless `inputs`, the content of inputs.json, are those of the structure's slurry."""
    held = (store.attributes.get("slurry"), len(store.particles))
    expected = (inputs.get("slurry"), inputs.get("particles"))
    if held != expected:
        texts = [f"slurry {slurry} with {count} particles" for slurry, count in (held, expected)]
        raise InputError(f"{store.path}: {texts[0]}, but the inputs are of {texts[1]}")


def write_wrapped(path: Path, title: str, types: Sequence[ParticleType], store: FrameStore) -> None:
    """Write the last frame of a store as a LAMMPS data file, with every particle inside the box.

    Parameters
    ----------
    path, title
        The file, and the words at the start of its first line.
    types
        All particle types.
    store
        The structure.
    """
    lower_um, edges_um = store.box(store.last)
    position_um = wrap(store.position_um(store.last), lower_um, edges_um)
    write_data(path, title, types, store.particles.type, position_um, lower_um, edges_um)


def start_temperature_k(inputs: Mapping, start_thermal_share: float) -> float:
    """Set point at which the thermostat starts: that of the DEM if `start_thermal_share` asks for less.

    Parameters
    ----------
    inputs
        Content of inputs.json.
    start_thermal_share
        k T over pressure x mean volume of a particle.
    """
    dem, counts = inputs["physics"]["dem"], np.array([t["particles"] for t in inputs["types"]])
    volume_um3 = mean_volume_um3(particle_types(inputs["physics"]["formulation"]["phases"]), counts)
    start_k = start_thermal_share / thermal_share(1.0, dem["pressure_kpa"], volume_um3)
    return max(start_k, dem["temperature_k"])


def explained(error: RunError, pushed: Log, slurry: str, packing_fraction: float) -> RunError:
    """The error of a relaxation, with the cause where overlaps were left before it.

    Left overlaps alone are no error: in a box that is a little too dense every particle has some, and it relaxes.

    Parameters
    ----------
    error
        That of relax.lmp.
    pushed
        Log of push_off.lmp.
    slurry, packing_fraction
        Id, and volume of the particles over that of the predicted box.
    """
    if pushed.thermo[-1, pushed.columns.index("c_highest")] < PUSHED_OFF_FJ:
        return error
    return RunError(
        f"slurry {slurry}: push_off.lmp left overlaps, in a box with a packing fraction of {packing_fraction:.2f}: set "
        f"relaxation.push_off_iterations higher, or predict a larger box; {error}"
    )


def end_state(log: Log, pressure: str) -> dict[str, float]:
    """How a run ended, as attributes of its structure: the last row of the log.

    Parameters
    ----------
    log
        That of relax.lmp or dry.lmp.
    pressure
        Column with the pressure that the barostat controls.
    """
    columns = ("Temp", "v_temperature_rotational_k", pressure, "v_kinetic_share")  # as in END_STATE
    last = dict(zip(log.columns, log.thermo[-1], strict=True))
    return {name: float(last[column]) for name, column in zip(END_STATE, columns, strict=True)}


def unrest(
    row: Mapping, pressure_kpa: float, max_kinetic_share: float, pressure_within: float, temperature_k: float
) -> list[str]:
    """What is out of bounds at the end of a run to `pressure_kpa`.

    Parameters
    ----------
    row
        kinetic_share, temperature_k and pressure_kpa at the end.
    pressure_kpa
        Pressure of the barostat.
    max_kinetic_share, pressure_within
        Largest kinetic energy over pressure x volume, and largest relative deviation of the pressure.
    temperature_k
        Set point of the thermostat: a structure not hotter than twice that is at rest, whatever its kinetic energy. For
        particles a tenth of micrometre wide, thermal energy alone is 1e-4 of pressure x volume.
    """
    found = []
    if row["kinetic_share"] > max_kinetic_share and row["temperature_k"] > 2 * temperature_k:
        found.append(
            f"kinetic energy is {row['kinetic_share']:.2g} of pressure x volume, at most {max_kinetic_share:.2g} is "
            "allowed"
        )
    deviation = row["pressure_kpa"] / pressure_kpa - 1
    if abs(deviation) > pressure_within:
        found.append(f"pressure is {100 * deviation:+.3g} % off, at most {100 * pressure_within:.3g} % is allowed")
    return found
