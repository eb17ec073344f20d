"""The DEM continued from the last input frame with a faster barostat until its density rests. Nothing is learned."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from slurrycast.dem.lammps_run import Progress
from slurrycast.runtime.files import RunError
from slurrycast.surrogates.base import SIMULATED, Surrogate
from slurrycast.surrogates.prediction import Prediction, PredictionInput


class EarlyDem(Surrogate):
    """The DEM with a faster barostat."""

    name = "early_dem"
    looks_at = "all particles, their velocities and contacts at the last input frame, and the forces of the DEM"
    box_rule = SIMULATED
    dem_script = "continue.lmp"
    variant = re.compile(r"x(?P<faster>[1-9]\d*)")  # how many times faster than the DEM's the barostat is

    def most_steps(self, settings: Mapping) -> int:
        """Steps that a prediction takes at most."""
        return settings["max_steps"]

    def predict(self, inputs: PredictionInput, model_path: Path | None, settings: Mapping) -> Prediction:
        """Continue the DEM in rounds of `flat_steps` steps until one is flat: coordinates (n, 3) and edges (3,) in um.

        A round is flat if the density changes by at most the share `flat_within`, and if the pressure at its beginning
        and end is within the share `pressure_within` of that of the barostat. RunError if no round within `max_steps`
        steps is flat.
        """
        from slurrycast.dem.lammps_dump import read_dump

        continuation = inputs.continuation
        dem = continuation.inputs["physics"]["dem"]
        round_steps, first = settings["flat_steps"], inputs.last.step
        rounds = settings["max_steps"] // round_steps
        log = continuation.run(
            self.dem_script,
            {
                "pressure_damping_us": dem["pressure_damping_us"] / int(settings["faster"]),
                "round_steps": round_steps,
                "max_rounds": rounds,
                "flat_within": settings["flat_within"],
                "pressure_within": settings["pressure_within"],
                "thermo_every_steps": round_steps,
            },
            Progress(f"{inputs.slurry} continued", first, first + rounds * round_steps, print),
        )
        density, pressure = (log.thermo[[0, -1], log.columns.index(name)] for name in ("v_density_g_cm3", "Press"))
        change, misfit = density[1] / density[0] - 1, np.abs(pressure / dem["pressure_kpa"] - 1)
        if abs(change) > settings["flat_within"] or misfit.max() > settings["pressure_within"]:
            raise RunError(
                f"{inputs.slurry}: not at rest after surrogate.early_dem.max_steps ({rounds * round_steps}) more "
                f"steps: density {100 * change:+.2g} % over the last {round_steps}, pressure {pressure[0]:.4g} to "
                f"{pressure[1]:.4g} kPa of {dem['pressure_kpa']:.4g}; log: {continuation.work / 'continue.log'}"
            )
        (end,) = read_dump(continuation.work / "continued.dump")
        print(f"[{inputs.slurry}] flat after {end.step - first} steps: {density[1]:.4f} g/cm3")
        return Prediction(end.values[:, 3:6], end.edges_um)
