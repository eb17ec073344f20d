"""Tables that are read back hold what was written, whatever slurries are called."""

import numpy as np
import pandas as pd
import pytest

from slurrycast.data.tables import read_equilibrium, read_table

NAMES = ["1", "007", "1e3", "NA", "nan", "None", "T1"]


def test_names_stay_text_and_empty_cells_are_missing(tmp_path):
    path = tmp_path / "table.csv"
    written = pd.DataFrame(
        {"surrogate": "-", "slurry": NAMES, "pair": "all", "g_dem": np.nan, "r2": [np.nan, *np.linspace(0, 1, 6)]}
    )
    written.to_csv(path, index=False)
    read = read_table(path)
    assert list(read.slurry) == NAMES
    assert list(read.surrogate) == ["-"] * len(NAMES)
    assert read.g_dem.dtype == read.r2.dtype == float
    pd.testing.assert_frame_equal(read[["g_dem", "r2"]], written[["g_dem", "r2"]])


def test_a_table_without_rows_keeps_its_columns(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("surrogate,slurry,axis,r2\n")
    assert list(read_table(path).columns) == ["surrogate", "slurry", "axis", "r2"]
    assert read_table(path).empty


@pytest.mark.parametrize("warnings", [["", ""], ["not in equilibrium", ""]])
def test_no_warning_is_the_empty_text(tmp_path, warnings):
    path = tmp_path / "equilibrium.csv"
    table = pd.DataFrame({"slurry": ["NA", "1"], "time_to_equilibrium_us": [np.nan, 2.5], "warning": warnings})
    table.to_csv(path, index=False)
    read = read_equilibrium(path)
    assert list(read.warning) == warnings
    assert list(read.slurry) == ["NA", "1"]
    assert np.isnan(read.time_to_equilibrium_us[0])
