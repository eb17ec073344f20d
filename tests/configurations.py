"""Configurations and slurry tables for tests: the shipped ones, and others that differ from them."""

import copy
from pathlib import Path

import yaml
from snakemake.utils import update_config

from slurrycast.config.slurry_table import Slurry, read_slurry_table

ROOT = Path(__file__).resolve().parents[1]
HEADER = "id\trole\tmass_units\tthickness_ratio\tseed\n"
SCALES = ["tiny", "reduced", "small", "start", "full", "size", "size_berendsen"]


def load(name: str) -> dict:
    """A file in config/ as it is."""
    return yaml.safe_load((ROOT / "config" / f"{name}.yaml").read_text(encoding="utf-8"))


def merged(base: dict, override: dict) -> dict:
    """What Snakemake makes of a configuration and a --configfile: mappings merged, everything else replaced."""
    result = copy.deepcopy(base)
    update_config(result, copy.deepcopy(override))
    return result


def shipped(scale: str) -> dict:
    """The effective configuration of a scale."""
    base = load("config")
    return base if scale == "config" else merged(base, load(scale))


def nested(path: str, value: object) -> dict:
    """`{"a": {"b": value}}` of the path a.b."""
    for key in reversed(path.split(".")):
        value = {key: value}
    return value


def read_slurries(path: Path | str) -> list[Slurry]:
    """The slurries of a table without problems."""
    slurries, lines = read_slurry_table(path)
    assert lines == []
    return slurries


def copy_tables(folder: Path) -> None:
    """Give a project folder the shipped slurry tables."""
    (folder / "config").mkdir()
    for table in (ROOT / "config").glob("*.tsv"):
        (folder / "config" / table.name).write_text(table.read_text(encoding="utf-8"), encoding="utf-8")
