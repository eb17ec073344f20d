"""Whether two results folders hold the same: what a campaign calls lost."""

import json
import re
import sys
import zipfile
from collections.abc import Iterable
from pathlib import Path

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
from slurrycast.runtime.files import InputError, check_unchanged

# Seconds, drawn from seconds, or a date: only that they are there and undamaged is compared.
OF_TIME = re.compile(
    r"costs/.*|logs/.*|dem/[^/]+/lammps\.log|tables/(cost|speedup)\.csv|figures/costs\.png|report\.html"
    r"|versions(/.*)?\.json"
    r"|figures/rulegraph\.dot"  # edges in any order; workflow.png, which is drawn from it, is compared
)
# Beside the outputs: checksums, logs, the trained model where it was made; the dump is kept on request only.
ASIDE = re.compile(r"(.*/)?\.checksums/.*|logs/.*|models/[^/]+/work/.*|dem/[^/]+/dump\.lammpstrj")


def differences(reference: Path, results: Path) -> list[str]:
    """What is missing, too much, damaged or different in `results`, one line each; empty if all is as it should be."""
    expected, found = (set(files(folder)) for folder in (reference, results))
    lines = [f"{name}: missing" for name in sorted(expected - found)]
    lines += [f"{name}: left behind" for name in sorted(found - expected)]
    lines += changed(reference, results, sorted(expected & found))
    for path in sorted((results / "frames").glob("*.h5")):
        lines += frame_errors(path, json.loads((results / "dem" / path.stem / "run.json").read_text()))
    return lines


def changed(reference: Path, results: Path, names: Iterable[str]) -> list[str]:
    """Which of the files of the reference are missing, damaged or different in `results`, one line each."""
    lines = []
    for name in names:
        if not (reference / name).exists():  # the dump
            continue
        try:
            check_unchanged(results / name)
            if not OF_TIME.fullmatch(name) and content(reference / name) != content(results / name):
                lines.append(f"{name}: differs")
        except InputError:
            lines.append(f"{name}: {'damaged' if (results / name).exists() else 'missing'}")
    return lines


def files(folder: Path) -> Iterable[str]:
    """Files of a results folder that have to be there, and no others."""
    names = (path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    return (name for name in names if not ASIDE.fullmatch(name))


def content(path: Path) -> object:
    """What a file says, without when it was written and how long it took."""
    if path.suffix == ".h5":
        with h5py.File(path) as file:
            return hdf5_content(file)
    if path.suffix == ".keras":
        with zipfile.ZipFile(path) as archive, archive.open("model.weights.h5") as weights, h5py.File(weights) as file:
            config = re.sub(rb'"shared_object_id": \d+', b"", archive.read("config.json"))  # a place in memory
            return config, hdf5_content(file)
    if path.name == "run.json":
        run = json.loads(path.read_text(encoding="utf-8"))
        return json.dumps([run | {"start": 0, "segments": 0}, [row["step_end"] for row in run["segments"]]])
    if path.name == "trained_on.json":  # the file of a model has the time when it was written
        return json.loads(path.read_text(encoding="utf-8")) | {"model_sha256": ""}
    return path.read_bytes()


def hdf5_content(file: h5py.File) -> list[tuple]:
    """Names, attributes and values of all that a file holds."""
    found = []

    def add(name: str, item: h5py.Group | h5py.Dataset) -> None:
        attributes = sorted((key, np.asarray(value).tolist()) for key, value in item.attrs.items())
        values = ()
        if isinstance(item, h5py.Dataset):  # bytes of objects are where they lie in memory
            value = np.asarray(item[()])
            values = (str(item.dtype), item.shape, value.tolist() if value.dtype.hasobject else value.tobytes())
        found.append((name, repr(attributes), *values))

    add("/", file)
    file.visititems(add)
    return found


def frame_errors(path: Path, run: dict) -> list[str]:
    """What is wrong with the frames of a slurry: those from 0 to the last one have to be there once, at their steps."""
    dem = run["physics"]["dem"]
    expected = np.arange(run["frames_written"]) * (dem["steps"] // (dem["frames"] - 1))
    with h5py.File(path) as file:
        steps = file["particles/slurry/position/step"][()]
    if np.array_equal(steps, expected):
        return []
    missing, doubled = len(set(expected) - set(steps)), len(steps) - len(set(steps))
    return [f"frames/{path.name}: {len(steps)} frames of {len(expected)}, {missing} missing, {doubled} doubled"]
