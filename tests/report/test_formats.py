"""Numbers and lists as text."""

import numpy as np
import pandas as pd
import pytest

from slurrycast.evaluation.speedup import time_unit
from slurrycast.report.formats import SlurryValue, listed, named, number, span


@pytest.mark.parametrize(
    ("value", "form", "text"),
    [
        *((0.5, "duration", "0.5 s"), (180, "duration", "180 s"), (198, "duration", "3.3 min")),
        *((12600, "duration", "3.5 h"), (np.nan, "duration", "–"), (None, ".3g", "–"), (-0.0001, "z.2f", "0.00")),
        *((1234.5, "plain", "1,234"), (0.12345, "plain", "0.123"), ("none", ".3g", "none")),
        *((SlurryValue(0.012, "6"), ".1%", "1.2% (slurry 6)"), (pd.Series([1.0, 2.5]), "g", "1 to 2.5")),
    ],
)
def test_numbers(value, form, text):
    assert number(value, form) == text


def test_words():
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "<c>"]) == "a, b and &lt;c&gt;"
    assert named(["1"]) == "slurry 1"
    assert named(["1", "2"], "Slurry") == "Slurries 1 and 2"
    assert span(pd.Series([1.0, 2.5]), "g", " µs") == "1 to 2.5 µs"
    assert span(pd.Series([2.0, 2.0])) == "2"
    assert [time_unit(seconds)[1] for seconds in (10, 1000, 20000)] == ["s", "min", "h"]
