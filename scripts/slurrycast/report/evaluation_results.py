"""The tables of a run's evaluation, and what to judge them by.

Means run over the slurries of role `test`; those of role `validation`, used to make choices, are shown beside them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from slurrycast import surrogates
from slurrycast.evaluation.verdicts import deviations


def labels_of(table: pd.DataFrame) -> list[str]:
    """Labels of the surrogates in a table, in their order."""
    return list(dict.fromkeys(table.surrogate))


def main_labels_of(table: pd.DataFrame) -> list[str]:
    """The same without variants and without those of earlier input frames."""
    return surrogates.main_labels(labels_of(table))


@dataclass(frozen=True)
class Evaluation:
    """Tables as in results/<run>/tables; the rest by slurry, surrogate or file stem."""

    run: str
    roles: Mapping[str, str]  # role by slurry
    networks: Sequence[str]  # labels that are held against affine and early_dem
    density_tolerance: float  # largest |density / that of the DEM - 1|
    rdf_tolerance: float  # largest mean |g - g of the DEM|, in replica spreads
    relaxed_for: Mapping[str, int]  # steps by surrogate
    skill: pd.DataFrame
    noise: pd.DataFrame
    structure_errors: pd.DataFrame
    front: pd.DataFrame
    equal_cost: pd.DataFrame
    cost_scaling: pd.DataFrame
    article_costs: pd.DataFrame
    ablation: pd.DataFrame | None
    relaxation: pd.DataFrame | None  # of the validation slurries
    uncertainty: pd.DataFrame | None  # where a surrogate has a spread
    figures: Mapping[str, Path]

    def slurries(self, role: str) -> list[str]:
        """Ids of the slurries of one role."""
        return [slurry for slurry, other in self.roles.items() if other == role]

    @property
    def test(self) -> list[str]:
        """Ids of the slurries that means run over."""
        return self.slurries("test")

    def tested(self, table: pd.DataFrame) -> pd.DataFrame:
        """Rows of the test slurries."""
        return table[table.slurry.isin(self.test)]

    def relaxed(self, surrogate: str) -> pd.DataFrame:
        """Deviations of the relaxed structures of `surrogate`: slurry, quantity, value, dem_value, deviation, in_sd."""
        table = deviations(self.structure_errors)
        return table[(table.stage == "relaxed") & (table.surrogate == surrogate)]

    def density_errors(self, surrogate: str) -> pd.Series:
        """|density / that of the DEM - 1| after relaxation, by slurry."""
        rows = self.relaxed(surrogate)
        rows = rows[rows.quantity == "density_g_cm3"].set_index("slurry")
        return (rows.deviation / rows.dem_value).rename("density")

    def rdf_in_spreads(self, surrogate: str) -> pd.DataFrame:
        """Mean |g - g of the DEM| after relaxation in replica spreads: slurries x rdf quantities."""
        rows = self.relaxed(surrogate)
        rows = rows[rows.quantity.str.startswith("rdf_")]
        return rows.pivot_table(index="slurry", columns="quantity", values="in_sd", sort=False)

    def best(self, labels: Sequence[str]) -> tuple[str, str] | None:
        """The one of `labels` with the lowest mean density error after relaxation, and the role that says so.

        The validation slurries say it where there are any, so that the test slurries are only evaluated.
        """
        for role in ("validation", "test"):
            errors = {name: self.density_errors(name).reindex(self.slurries(role)).mean() for name in labels}
            known = pd.Series(errors, dtype=float).dropna()
            if not known.empty:
                return str(known.idxmin()), role
        return None
