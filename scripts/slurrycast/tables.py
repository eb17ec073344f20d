"""Tables that the workflow wrote, read back with the ids of slurries as text."""

from pathlib import Path

import pandas as pd

TEXTS = {"slurry": str, "surrogate": str, "warning": str}


def read_table(path: str | Path) -> pd.DataFrame:
    """Read a table (CSV). Names are text whatever they look like, `007` and `NA` too; an empty cell is missing."""
    return pd.read_csv(path, dtype=TEXTS, keep_default_na=False, na_values=[""])


def read_equilibrium(path: str | Path) -> pd.DataFrame:
    """Read tables/equilibrium.csv; a missing warning is the empty text."""
    table = read_table(path)
    return table.assign(warning=table.warning.fillna(""))
