"""The tables of a run's evaluation, and what to judge them by.

Means run over the slurries of role `test`; those of role `validation`, used to make choices, are shown beside them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from slurrycast import surrogates


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
    skill: pd.DataFrame
    noise: pd.DataFrame
    structure_errors: pd.DataFrame
    verdicts: pd.DataFrame
    front: pd.DataFrame
    equal_cost: pd.DataFrame
    cost_scaling: pd.DataFrame
    article_costs: pd.DataFrame
    ablation: pd.DataFrame | None
    relaxation: pd.DataFrame | None  # of the validation slurries
    uncertainty: pd.DataFrame | None  # where a surrogate has a spread
    tape_errors: pd.DataFrame | None  # where tapes of surrogates are judged
    tape_verdicts: pd.DataFrame | None
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

    def density_errors(self, surrogate: str) -> pd.Series:
        """|density / that of the DEM - 1| after relaxation, by slurry."""
        table = self.structure_errors
        rows = table[(table.stage == "relaxed") & (table.surrogate == surrogate) & (table.quantity == "density_g_cm3")]
        return (rows.value / rows.dem_value - 1).abs().set_axis(rows.slurry)
