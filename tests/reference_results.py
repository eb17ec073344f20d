"""Tables of results/reference, whose columns and quantities have the names of the commits that wrote them."""

from pathlib import Path

import pandas as pd

from slurrycast.data.tables import read_table

OLD_VALUES = {"quantity": {"twin_floor_um2": "perturbation_floor_um2"}}


def read_reference(path: Path) -> pd.DataFrame:
    """Read a table with today's names."""
    return read_table(path).replace(OLD_VALUES)
