"""Readers of what may be damaged, foreign or made by hand: the same data, or one line that names the file."""

import json
from contextlib import suppress
from dataclasses import replace

import h5py
import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from damage import assert_names_its_file, variants
from slurrycast.data.dataset import read_training_set, write_training_set
from slurrycast.data.frames import GROUP, read_frames, write_frames
from slurrycast.data.tables import read_equilibrium, read_table
from slurrycast.runtime.command_line import Parser, input_file
from slurrycast.runtime.files import InputError
from structures import random_frame, random_particles, training_set

N = 8
STORE = {"slurry": "A", "scale": 0.5}


def write_store(path):
    spread_um = np.random.default_rng(1).random((N, 3))
    frames = [replace(random_frame(number, N), position_spread_um=spread_um) for number in (7, 120)]
    write_frames(path, random_particles(N), frames, STORE)


def store_content(path) -> list:
    with read_frames(path) as store:
        frames = [value for k in store.frame_numbers for value in vars(store.frame(k)).values()]
        return [*vars(store.particles).values(), store.steps, store.times_us, *frames]


def write_set(path):
    rng = np.random.default_rng(5)
    edges_um = rng.uniform(5, 9, (2, 2, 3))
    data = training_set(rng.normal(size=(N, 2, 6)), rng.normal(size=(N, 3)), edges_um, 0.7 * edges_um[:, 0])
    write_training_set(path, data, seed=3)


def set_content(path) -> list:
    return list(vars(read_training_set(path)).values())


HDF5 = {"frame store": (write_store, store_content), "training set": (write_set, set_content)}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Each kind of HDF5 file: path, bytes, reader, and what it reads."""
    found = {}
    for kind, (write, read) in HDF5.items():
        path = tmp_path_factory.mktemp(kind) / "a file.h5"
        write(path)
        found[kind] = (path, path.read_bytes(), read, read(path))
    return found


def same(a: list, b: list) -> bool:
    return len(a) == len(b) and all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


@pytest.mark.parametrize("kind", HDF5)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
def test_flipped_bit_is_noticed(written, kind, place, bit):
    path, content, read, _ = written[kind]
    damaged = bytearray(content)
    damaged[int(place * len(content))] ^= 1 << bit
    path.write_bytes(damaged)
    with pytest.raises(InputError, match=r"a file\.h5: not what was written there, it is damaged or was edited"):
        read(path)


@pytest.mark.parametrize("kind", HDF5)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(share=st.floats(0, 1, exclude_max=True))
def test_truncated_file_without_a_checksum_is_noticed(written, tmp_path_factory, kind, share):
    path, content, read, _ = written[kind]
    path = tmp_path_factory.mktemp("copied") / path.name
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(InputError, match=rf"a file\.h5: not a readable {kind}"):
        read(path)


def names_in(content: bytes, path) -> list[str]:
    """Groups, arrays and attributes (`@name`) of an HDF5 file."""
    path.write_bytes(content)
    names = []

    def add(name, item):
        names.extend([name, *(f"{name}@{attribute}" for attribute in item.attrs)])

    with h5py.File(path) as file:
        names += [f"@{attribute}" for attribute in file.attrs]
        file.visititems(add)
    return names


FOREIGN = {
    "none": None,
    "text": "text",
    "texts": ["a", "b", "c"],
    "number": 3,
    "empty": np.empty(0),
    "one too few": np.ones(N - 1),
    "three": np.ones((N, 3, 3)),
    "NaN": np.nan,
    "code": "__import__('os').system('touch x')",
}


@pytest.mark.parametrize("kind", HDF5)
@pytest.mark.parametrize("instead", FOREIGN)
def test_something_else_in_any_place_is_refused_or_not_needed(written, tmp_path, monkeypatch, kind, instead):
    """A file without a checksum, as from elsewhere, with each of its parts missing or replaced in turn."""
    monkeypatch.chdir(tmp_path)
    _, content, read, good = written[kind]
    path = tmp_path / "foreign.h5"
    refused = 0
    for name in names_in(content, path):
        path.write_bytes(content)
        item, _, attribute = name.partition("@")
        with h5py.File(path, "r+") as file:
            place = file[item or "/"].attrs if attribute else file
            del place[attribute or item]
            if FOREIGN[instead] is not None:
                place[attribute or item] = FOREIGN[instead]
        try:
            found = read(path)
        except InputError as error:
            refused += 1
            assert_names_its_file(error, path)
        else:
            # of the attributes some are only shown, and others any text or number will do
            assert attribute or same(found, good) or (name, instead) == (f"{GROUP}/position_spread", "none"), name
    assert refused > 5
    assert [entry.name for entry in tmp_path.iterdir()] == ["foreign.h5"]


# ---- tables and JSON

TABLE = "surrogate,slurry,warning,r2\n-,007,not in equilibrium,0.5\n-,T1,,1\n"


@settings(max_examples=200, deadline=None)
@given(content=st.one_of(st.binary(), variants(TABLE)))
@example(b"")
@example(b'a,b\n"1,2\n')
@example(b"a,b\n1,2,3\n1,2,3,4\n")
def test_any_table_is_read_or_refused_with_its_name(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_bytes(content)
    for read in (read_table, read_equilibrium):
        try:
            assert isinstance(read(path), pd.DataFrame)
        except InputError as error:
            assert_names_its_file(error, path)


VALUES = st.recursive(st.none() | st.booleans() | st.floats() | st.text(), lambda item: st.lists(item, max_size=3))
TEXTS = st.one_of(st.text().map(str.encode), st.binary(), VALUES.map(lambda value: json.dumps(value).encode()))


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=TEXTS)
@example(b"[" * 100_000)
@example(b'{"a": ' * 100_000)
@example(b"\xff\xfe")
@example(b"9" * 5000)
@example(b"{}")
def test_any_json_input_is_a_mapping_or_refused_with_its_name(tmp_path_factory, capsys, content):
    path = tmp_path_factory.getbasetemp() / "any.json"
    path.write_bytes(content)
    parser = Parser("A script.")
    parser.add_argument("--inputs", type=input_file)
    with suppress(SystemExit):
        assert parser.parse_args(["--inputs", str(path)]).inputs == path
        assert isinstance(json.loads(content), dict)
        return
    said = capsys.readouterr().err
    assert said.startswith(f"error: argument --inputs: {path}: not ")
    assert len(said.splitlines()) == 1
