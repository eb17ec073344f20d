"""Configurations and slurry tables for tests: the shipped ones, and others that differ from them."""

import copy
from pathlib import Path

import yaml
from snakemake.utils import update_config

from slurrycast.config.slurry_table import Slurry, read_slurry_table

ROOT = Path(__file__).resolve().parents[1]
HEADER = "id\trole\tmass_units\tthickness_ratio\tseed\n"
SCALES = [
    "tiny",
    "recipe",
    "my_recipe",
    "reduced",
    "small",
    "start",
    "epochs",
    "published",
    "published_dt1e-4",
    "size",
    "size_berendsen",
    "transfer",
    "tape",
    "explore",
]


BEHIND = {"my_recipe": "recipe"}  # a file that is for use behind another one


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
    base = shipped(BEHIND.get(scale, "config")) if scale != "config" else {}
    return merged(base, load(scale))


def scaled(config: dict, factor: float) -> dict:
    """The configuration with particles larger by a factor, and all that makes their motion the same but for the scale.

    At equal densities and pressure, times go with lengths, energies with volumes.
    """
    formulation, force_field, dem = config["formulation"], config["force_field"], config["dem"]
    force_field["lennard_jones"]["epsilon_fj_per_um"] *= factor**2
    force_field["granular_hertz"]["normal_damping_per_um_us"] /= factor**2
    formulation["unit_mass_pg"] *= factor**3
    for phase in formulation["phases"].values():
        for size_class in phase["size_classes"]:
            size_class["diameter_um"] *= factor
    for key in ("timestep_us", "temperature_damping_us"):
        dem[key] *= factor
    measured = config["microstructure"]
    measured["spacing_um"] *= factor
    measured["tortuosity_spacings_um"] = [spacing_um * factor for spacing_um in measured["tortuosity_spacings_um"]]
    config["analysis"]["rdf_cutoff_um"] *= factor
    return config


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
