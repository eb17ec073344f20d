"""How fast the particles of a DEM run move: temperatures, and the kinetic energy beside that of the pressure.

A temperature says nothing about heat here. That of translation is 2/3 of the mean kinetic energy of a particle over k,
that of rotation the same of its rotational energy. The thermostat of the DEM acts on the mean of both.
"""

import pandas as pd

from slurrycast.dem.forcefield import BOLTZMANN_FJ_K

DENSIFIED = 0.99  # share of the last density from which on a slurry no longer counts as densifying


def densifying(thermo: pd.DataFrame) -> pd.DataFrame:
    """Rows of thermo.csv after the start and before the density first reaches `DENSIFIED` of its last value."""
    dense = thermo.density_g_cm3 >= DENSIFIED * thermo.density_g_cm3.iloc[-1]
    return thermo.iloc[1 : int(dense.to_numpy().argmax())]


def kinetic_share(row: pd.Series, particles: int, pressure_kpa: float) -> float:
    """Kinetic energy, of translation and rotation, over pressure x volume, for one row of thermo.csv.

    `pressure_kpa` is that of the barostat. LAMMPS leaves out the three degrees of freedom of the whole slurry in the
    temperature of translation, and none in that of rotation. 1 kPa um3 = 1 fJ.
    """
    kelvins = (particles - 1) * row.temperature_k + particles * row.temperature_rotational_k
    return 1.5 * BOLTZMANN_FJ_K * kelvins / (pressure_kpa * row.lx_um * row.ly_um * row.lz_um)
