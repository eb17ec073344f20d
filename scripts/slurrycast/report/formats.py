"""Numbers and lists as text: the filters of the templates."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import pandas as pd
from markupsafe import Markup

from slurrycast.evaluation.speedup import time_unit

MISSING = "–"


class SlurryValue(NamedTuple):
    """A value and the slurry that has it; shown as "1.2 (slurry 3)"."""

    value: float
    slurry: str


def widest(values: pd.Series, lowest: bool = False) -> SlurryValue | None:
    """The largest or the lowest of `values` (by slurry) and its slurry; None where no value is known."""
    known = values.dropna().sort_values(ascending=lowest, kind="stable")
    return SlurryValue(known.iloc[0], known.index[0]) if len(known) else None


def number(value: float | str | SlurryValue | pd.Series | None, form: str = ".3g") -> str:
    """Text of a table's cell or of a number in a sentence.

    Parameters
    ----------
    value
        A number, the values of a range, a value with its slurry, or a text, which stays as it is.
    form
        Python's format, or "duration" (of seconds), or "plain" (three digits, and whole numbers from 1,000 on).

    Returns
    -------
    str
        A dash where there is no number.
    """
    if isinstance(value, str):
        return value
    if isinstance(value, pd.Series):
        return span(value, form)
    if isinstance(value, SlurryValue):
        return f"{number(value.value, form)} (slurry {value.slurry})"
    if value is None or pd.isna(value):
        return MISSING
    if form == "duration":
        length_s, unit = time_unit(value)
        return f"{value / length_s:.3g} {unit}"
    if form == "plain":
        form = ",.0f" if abs(value) >= 1000 else ".3g"
    return format(value, form)


def numbers(values: Iterable, form: str = ".3g") -> list[str]:
    """Texts of several cells of one format."""
    return [number(value, form) for value in values]


def span(values: pd.Series, form: str = ".3g", unit: str = "") -> str:
    """Text of a range: "a to b unit", or the one value."""
    low, high = number(values.min(), form), number(values.max(), form)
    return f"{low}{unit}" if low == high else f"{low} to {high}{unit}"


def listed(texts: Iterable[str]) -> Markup:
    """Text of a list: "a, b and c"."""
    *first, last = texts = list(texts) or [""]
    return Markup(" and ").join([Markup(", ").join(first), last] if len(texts) > 1 else [last])


def separator(loop: object) -> str:
    """What stands before an entry of a list that a template's loop writes: nothing, a comma or "and"."""
    return "" if loop.first else " and " if loop.last else ", "


def named(slurries: Sequence[str], noun: str = "slurry") -> Markup:
    """Text of some slurries: "slurry 1", "slurries 1 and 2"; `noun` can begin a sentence."""
    return Markup(f"{noun if len(slurries) == 1 else noun[:-1] + 'ies'} ") + listed(slurries)


def columns(labels: Iterable[str], form: str = ".3g") -> list[tuple[str, str]]:
    """A table's columns of one format, one for each label."""
    return [(label, form) for label in labels]
