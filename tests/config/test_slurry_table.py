"""The slurry table: good tables are read as written, bad ones are refused in one line for each problem."""

import json
import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from configurations import HEADER, ROOT, read_slurries
from slurrycast.config.configuration import check
from slurrycast.config.slurry_table import Slurry, read_slurry_table

pytestmark = pytest.mark.usefixtures("in_empty_project")

ROW = {"id": "T1", "role": "train", "mass_units": "1", "thickness_ratio": "1", "seed": "1"}
ID, MASS = "text of at most 50 letters, digits and '_', once in the table", "a number above 0 and at most 100"
RATIO, TEXTS = "a number at least 0.01 and at most 100", {cell: f'"{cell}"' for cell in ("one", "nan", "1,5")}
# column: what a cell must be, and cells that are not, with their values as the line shows them
BAD_CELLS = {
    "id": (ID, {"T 1": '"T 1"', "../x": '"../x"', "": '""'}),
    "role": ("one of train, validation, test, new", {"Train": '"Train"', "trian": '"trian"'}),
    "mass_units": (MASS, TEXTS | {"1e999": "Infinity"} | {cell: str(float(cell)) for cell in ("-1", "0", "773.5")}),
    "thickness_ratio": (RATIO, {cell: str(float(cell)) for cell in ("-1", "1000", "0.001")}),
    "seed": (
        "a whole number from 1 to 2147483647, once in the table",
        {"0": "0", "1.5": '"1.5"', "2147483648": "2147483648", "9" * 5000: '"' + "9" * 56 + "..."},
    ),
}
BAD_HEADERS = [
    HEADER.replace("\t", ","),
    HEADER.replace("seed", "seed\tnote"),
    HEADER.replace("\tseed", ""),
    HEADER.replace("seed", "id"),
    HEADER.replace("mass_units", "mass_pg"),
]
COLUMNS = (
    "must be the columns id, role, mass_units, thickness_ratio, seed, and formulation if you like, separated by tabs"
)
NAMED_ALIKE = "is named like a slurry of the table: rename that slurry"
# rows, the line
BAD_ROWS = {
    "": "s.tsv: no slurries: must be at least one row below the column names",
    "T1\ttrain\t1\t1\n": "s.tsv line 2: 4 cells: must be 5, separated by tabs",
    "T1 train 1 1 1\n": "s.tsv line 2: 1 cells: must be 5, separated by tabs",
    "A\ttest\t1\t1\t1\n\nA\ttest\t1\t1\t2\n": 's.tsv line 4: id = "A": must differ from line 2',
    "my_work\ttest\t1\t1\t1\n": ('s.tsv line 2: id = "my_work": must not be logs, begin with work or end with _work'),
    "A\ttest\t1\t1\t5\nB\ttest\t1\t1\t5\n": "s.tsv line 3: seed = 5: must differ from line 2",
    "A\ttrain\t1\t1\t1\nB\tvalidation\t1\t1\t2\n": "s.tsv: no slurry of role test or new: must be at least one",
    "A\tnew\t1\t1\t1\n": "s.tsv: no slurry of role train: must be at least one for affine, or surrogate.models",
    "6_r1\ttrain\t1\t1\t1\n6\ttest\t1\t1\t2\n": f"evaluation.replicated: its run 6_r1 {NAMED_ALIKE}",
    "1_r1\ttrain\t1\t1\t1\n1\ttest\t1\t1\t2\n": f"drying.replicas: its run 1_r1 {NAMED_ALIKE}",
    "V1_dt100ps_s1\ttrain\t1\t1\t1\nV1\ttest\t1\t1\t2\n": f"convergence.slurry: its run V1_dt100ps_s1 {NAMED_ALIKE}",
    "1\ttrain\t1\t1\t1\n1_rdf\ttest\t1\t1\t2\n": "s.tsv: slurries 1 and 1_rdf would both write 1_rdf.csv: rename one",
    "1\ttrain\t1\t1\t1\nbox_1\ttest\t1\t1\t2\n": (
        "s.tsv: slurry_vgg16_box_1.png would show slurry box_1 of vgg16 and slurry 1 of vgg16_box: rename one"
    ),
    "A\ttest\t1\t1\t" + "5" * 200_000: (
        "s.tsv line 2: field larger than field limit (131072): must be cells separated by tabs"
    ),
}
BAD_TABLES = [
    ("", f"s.tsv line 1: nothing: {COLUMNS}"),
    *((header, f"s.tsv line 1: {json.dumps(header.strip())}: {COLUMNS}") for header in BAD_HEADERS),
    *((HEADER + rows, line) for rows, line in BAD_ROWS.items()),
    *(
        (HEADER + "\t".join((ROW | {column: cell}).values()), f"s.tsv line 2: {column} = {value}: must be {must_be}")
        for column, (must_be, cells) in BAD_CELLS.items()
        for cell, value in cells.items()
    ),
]


@pytest.mark.parametrize(("text", "line"), BAD_TABLES, ids=[line[:70] for _, line in BAD_TABLES])
def test_bad_table(config, text, line):
    Path("s.tsv").write_text(text, encoding="utf-8")
    assert check(config | {"slurries": "s.tsv"}) == [line]


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("missing.tsv", f"neither in {{folder}} nor in {ROOT}"),
        ("/no/such.tsv", "No such file or directory"),
        ("config", "Is a directory"),
        ("x" * 5000, "File name too long"),
        ("utf16.tsv", "'utf-8' codec can't decode byte 0xff in position 0: invalid start byte"),
        ("nul\0", "embedded null byte"),
    ],
)
def test_table_that_is_no_text_or_no_file(path, reason, tmp_path):
    Path("utf16.tsv").write_text(HEADER, encoding="utf-16")
    assert read_slurry_table(path) == ([], [f"{path}: cannot be read: {reason.format(folder=tmp_path)}"])


def test_table_that_is_not_in_the_project_where_this_is_the_working_directory(monkeypatch):
    monkeypatch.chdir(ROOT)
    assert read_slurry_table("no.tsv") == ([], [f"no.tsv: cannot be read: not in {ROOT}"])


@pytest.mark.parametrize("column", ["mass_units", "thickness_ratio"])
@pytest.mark.parametrize("factor", ["1e3", "1e-3"])
def test_no_column_passes_a_factor_of_1000_off(config, column, factor):
    Path("s.tsv").write_text(HEADER + "\t".join((ROW | {column: factor}).values()) + "\nB\ttest\t1\t1\t2\n")
    assert check(config | {"slurries": "s.tsv"})


def test_columns_in_any_order_with_byte_order_mark_and_windows_line_ends():
    text = "\ufeffseed\tid\trole\tthickness_ratio\tmass_units\r\n7\t a_1 \tnew\t1.5\t2e0\r\n\r\n"
    Path("s.tsv").write_bytes(text.encode("utf-8"))
    assert read_slurries("s.tsv") == [Slurry("a_1", "new", 2.0, 1.5, 7)]


def test_shipped_tables_have_the_intended_sizes():
    slurries, tiny = read_slurries("config/slurries.tsv"), read_slurries("config/slurries_tiny.tsv")
    masses = {role: [s.mass_units for s in slurries if s.role == role] for role in ("train", "test")}
    assert masses == {"train": [1, 1, 2, 2, 2.6, 3, 3, 4], "test": [3, 1, 1, 2, 2, 5, 4]}
    ratios = {s.id: s.thickness_ratio for s in slurries if s.role == "test"}
    assert ratios == dict.fromkeys("12367", 2.0) | dict.fromkeys("45", 1.2)
    assert [s.role for s in tiny] == ["train"] * 3 + ["test"] * 2 + ["validation", "new"]
    assert {s.thickness_ratio for s in tiny} == {1.0}


CELLS = st.one_of(st.sampled_from(["T1", "train", "1", "2.5", "", '"', "new", "1e9"]), st.text(max_size=8))
TABLES = st.one_of(
    st.text(),
    st.text().map(HEADER.__add__),
    st.lists(st.lists(CELLS, min_size=4, max_size=6).map("\t".join)).map(lambda rows: HEADER + "\n".join(rows)),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=150, deadline=None)
@given(TABLES)
@example(HEADER + '"\t\n"')
@example(HEADER + "T1\ttrain\t1\t1\t\N{ARABIC-INDIC DIGIT ONE}")
def test_any_text_is_read_or_refused_in_lines_that_name_the_file(text):
    Path("any.tsv").write_text(text, encoding="utf-8", newline="")
    slurries, lines = read_slurry_table("any.tsv")
    assert slurries or lines
    assert all(line.startswith("any.tsv") and len(line.splitlines()) == 1 for line in lines)
    assert all(re.fullmatch(r"[A-Za-z0-9_]+", s.id) and s.mass_units > 0 for s in slurries)


ROWS = st.builds(
    Slurry,
    id=st.from_regex(r"[A-Za-z0-9_]{1,50}", fullmatch=True),
    role=st.sampled_from(["train", "validation", "test", "new"]),
    mass_units=st.floats(1e-6, 100),
    thickness_ratio=st.floats(0.01, 100),
    seed=st.integers(1, 2**31 - 1),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.lists(ROWS, min_size=1, max_size=5, unique_by=(lambda s: s.id, lambda s: s.seed)))
def test_good_tables_are_read_as_written(slurries):
    rows = [f"{s.id}\t{s.role}\t{s.mass_units!r}\t{s.thickness_ratio!r}\t{s.seed}\n" for s in slurries]
    Path("good.tsv").write_text(HEADER + "".join(rows))
    assert read_slurries("good.tsv") == slurries
