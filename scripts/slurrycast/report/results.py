"""What a run leaves behind, as its report reads it.

Every surrogate has a column of its own. Means and ranges run over the slurries of role `test`; those of role
`validation` are shown beside them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from slurrycast.report.network_table import Network


def with_differences(structures: pd.DataFrame) -> pd.DataFrame:
    """Add the columns difference (hybrid less DEM, g/cm3) and share (of the DEM's) to density and dem_density."""
    difference = structures.density - structures.dem_density
    return structures.assign(difference=difference, share=difference / structures.dem_density)


@dataclass(frozen=True)
class Results:
    """Tables as in results/<run>/tables; the rest by slurry, surrogate or file stem."""

    config: Mapping
    config_text: str
    versions: Mapping
    roles: Mapping[str, str]  # by slurry, in the order of the slurry table
    formulations: Mapping[str, str]  # names of their recipes, "" of the default
    expected_g_cm3: Mapping[str, float]  # density that their recipes expect in equilibrium
    inputs: Mapping[str, Mapping]  # inputs.json by slurry
    runs: Mapping[str, Mapping]  # run.json by slurry, of those that have a DEM, as in `equilibrium`
    density: pd.DataFrame
    coordinate_errors: pd.DataFrame
    rdf_errors: pd.DataFrame
    equilibrium: pd.DataFrame
    relaxation_ends: pd.DataFrame
    microstructure: pd.DataFrame | None  # None where nothing is dried
    drying_ends: pd.DataFrame | None
    drying_calibration: pd.DataFrame | None
    training_range: pd.DataFrame | None  # None without training slurries, and where none would leave it
    costs: pd.DataFrame
    speedup: pd.DataFrame
    surrogates: Sequence[str]  # labels, in the order of columns
    left_out: Sequence[str]  # labels that would need training slurries
    descriptions: Mapping[str, tuple[str, str]]  # what a surrogate looks at, and its rule for the final box, in words
    histories: Mapping[str, pd.DataFrame]  # of the surrogates that are Keras models, as are the networks
    networks: Mapping[str, Network]
    weights_of: Mapping[str, str]  # of the same: of the epoch of the "lowest" validation loss or of the "last"
    figures: Mapping[str, Path]

    def slurries(self, *roles: str) -> list[str]:
        """Ids of the slurries in one of `roles`, in the order of the slurry table."""
        return [slurry for slurry, role in self.roles.items() if role in roles]

    @property
    def particles(self) -> dict[str, int]:
        """Number of particles of each slurry."""
        return {slurry: sum(each["particles"] for each in self.inputs[slurry]["types"]) for slurry in self.roles}

    @property
    def adopted(self) -> dict[str, str]:
        """Paths of the models that were trained elsewhere, by label."""
        models = self.config["surrogate"]["models"]
        return {label: models[label] for label in self.networks if label in models}

    @property
    def test(self) -> list[str]:
        """Ids of the slurries that means and ranges run over."""
        return self.slurries("test")

    @property
    def compared(self) -> list[str]:
        """Ids of the slurries that are predicted and have a target."""
        return self.slurries("validation", "test")

    @property
    def pairs(self) -> list[str]:
        """Pairs of phases whose RDF is compared."""
        return list(dict.fromkeys(self.rdf_errors.pair))

    def row_name(self, slurry: str) -> str:
        """Text of a slurry at the head of a row: those that choices are made on are marked."""
        return f"{slurry} (validation)" if slurry in self.slurries("validation") else slurry

    def structures(self, surrogate: str) -> pd.DataFrame:
        """Final DEM and hybrid structure of every slurry of the hybrid chain, by slurry; no DEM values for new ones.

        Columns: dem_density, dem_volume, density, volume, difference (hybrid less DEM, g/cm3), share (of the DEM's).
        """
        names = {"density_g_cm3": "density", "volume_um3": "volume"}
        by_slurry = self.density.set_index("slurry")[[*names, "surrogate", "model"]].rename(columns=names)
        hybrid = by_slurry.loc[by_slurry.surrogate == surrogate, names.values()]
        dem = by_slurry.loc[by_slurry.model == "DEM", names.values()].add_prefix("dem_")
        order = [slurry for slurry in self.roles if slurry in hybrid.index]
        return with_differences(hybrid.loc[order].join(dem))

    def errors(self, surrogate: str, axis: str = "all") -> pd.DataFrame:
        """Coordinate errors along `axis`, by slurry."""
        table = self.coordinate_errors
        return table[(table.surrogate == surrogate) & (table.axis == axis)].set_index("slurry")

    def rdf_differences(self, surrogate: str, pair: str) -> pd.Series:
        """Mean absolute difference of target and relaxed RDF of `pair`, by slurry."""
        table = self.rdf_errors
        rows = table[(table.surrogate == surrogate) & (table.pair == pair)]
        return rows.set_index("slurry").mean_abs_difference

    def mean_over_test(self, values: pd.Series) -> float:
        """Mean of `values` (by slurry) over the test slurries; NaN where there are none."""
        return values.reindex(self.test).mean()

    def speedups(self, clock: str) -> pd.DataFrame:
        """Rows of tables/speedup.csv by one clock, "wall_s" or "cpu_s"."""
        return self.speedup[self.speedup.clock == clock]
