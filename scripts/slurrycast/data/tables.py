"""Tables that the workflow wrote, read back with the ids of slurries as text."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from slurrycast.runtime.files import InputError, write_text

TEXTS = {"slurry": str, "surrogate": str, "warning": str}


def read_table(path: str | Path) -> pd.DataFrame:
    """Read a table (CSV). Names are text whatever they look like, `007` and `NA` too; an empty cell is missing.

    InputError if it is none.
    """
    try:
        return pd.read_csv(path, dtype=TEXTS, keep_default_na=False, na_values=[""])
    except (OSError, ValueError) as error:  # pandas' own errors are ValueErrors
        raise InputError(f"{path}: not a readable table ({' '.join(str(error).split())})") from error


def read_equilibrium(path: str | Path) -> pd.DataFrame:
    """Read tables/equilibrium.csv; a missing warning is the empty text. InputError if it has no such column."""
    table = read_table(path)
    if "warning" not in table:
        raise InputError(f"{path}: has no column warning, but {', '.join(map(repr, table.columns))}")
    return table.assign(warning=table.warning.fillna(""))


def write_table(
    path: str | Path,
    rows: pd.DataFrame | Sequence[Mapping],
    columns: Sequence[str] | None = None,
    digits: int = 9,
) -> None:
    """Write a table (CSV) in one move, with the given columns if any, and numbers with so many significant digits."""
    write_text(path, pd.DataFrame(rows, columns=columns).to_csv(index=False, float_format=f"%.{digits}g"))
