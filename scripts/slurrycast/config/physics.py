"""Physics of a DEM run: all settings that its results depend on, stored with them and compared before a run goes on."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from slurrycast.config.derived_runs import dem_settings
from slurrycast.config.formulations import of_slurry, wet_recipes
from slurrycast.config.schema_errors import shown
from slurrycast.config.slurry_table import Slurry

DEM_START = {"executable", "launcher", "ranks", "budget_min"}
DEM_BOUNDS = {"max_rayleigh_share", "max_hertz_share", "impact_speed_um_us", "max_density_drift"}
# Settings of `dem` that leave its results as they are: how it is started, and bounds that are only checked. All others
# count as physics, also the frames of a segment: a run holds one set.
DEM_NOT_PHYSICS = DEM_START | DEM_BOUNDS


def physics(config: Mapping, slurry: Slurry) -> dict:
    """All that the DEM of `slurry` depends on, to be stored with its results; survives JSON unchanged.

    Left out: the slurry's role, the density that is only expected, and DEM_NOT_PHYSICS. The order of the phases numbers
    them, so it is listed: a mapping does not keep it.
    """
    config = of_slurry(config, slurry)
    formulation = {key: value for key, value in config["formulation"].items() if key != "expected_density_g_cm3"}
    return {
        "formulation": formulation | {"order": list(formulation["phases"])},
        "force_field": _one_form(config["force_field"], formulation["phases"]),
        "dem": {key: value for key, value in dem_settings(config, slurry).items() if key not in DEM_NOT_PHYSICS},
        "slurry": {key: getattr(slurry, key) for key in ("mass_units", "thickness_ratio", "seed")},
    }


def _one_form(force_field: Mapping, phases: Mapping) -> dict:
    """The section force_field in the one form that says the same of these phases.

    It has no `pairs` where none of them is of these phases, as in runs of before there were any.
    """
    pairs = {tuple(sorted(pair.split("-"))): own for pair, own in force_field["pairs"].items()}
    pairs = {"-".join(pair): own for pair, own in pairs.items() if {*pair} <= {*phases}}
    one_form = {key: value for key, value in force_field.items() if key != "pairs"}
    return one_form | {"pairs": dict(sorted(pairs.items()))} if pairs else one_form


def flat_settings(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield (key path, value) for all in a section that is no mapping and no list of mappings."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from flat_settings(item, f"{path}.{key}".lstrip("."))
    elif isinstance(value, list) and any(isinstance(item, Mapping) for item in value):
        for index, item in enumerate(value):
            yield from flat_settings(item, f"{path}[{index}]")
    else:
        yield path, value


def shown_wet(key: str, wet: Mapping[str, Any], written: Mapping[str, Any]) -> str:
    """Text of a setting in a wet composition, and what its user wrote if that is another fraction; both are flat."""
    same = "mass_fraction" not in key or key not in written or wet[key] == written[key]
    return shown(wet[key]) if same else f"{shown(wet[key])} with solvent, written as {shown(written[key])}"


def changed_physics(config: Mapping, slurries: Sequence[Slurry], results: str | Path) -> list[str]:
    """Refuse settings other than those with which the DEM results under `results` were computed.

    Parameters
    ----------
    config : mapping
        The configuration as its user wrote it.
    slurries : sequence of Slurry
        All DEM runs that it may ask for.
    results : path
        Folder of the run; `physics` in its `dem/<slurry>/run.json` holds the settings of each slurry that has been run,
        that in `inputs.json` those of one that was cut off.

    Returns
    -------
    list of str
        One line for all differences, and one for each file that cannot be read; none where `run.overwrite` is true.
    """
    if config["run"]["overwrite"]:
        return []
    way_out = "choose another run.name, or set run.overwrite: true to compute it anew"
    lines, differences, wet = [], {}, wet_recipes(config)
    for slurry in slurries:
        folder = Path(results) / "dem" / slurry.id
        path = folder / "run.json"
        if not path.exists():
            if not any(folder.glob("work/segment_*.json")):
                continue
            path = folder / "inputs.json"  # of a run that was cut off, whose finished segments would be lost
        try:
            before = dict(flat_settings(json.loads(path.read_text(encoding="utf-8"))["physics"]))
        except (OSError, ValueError, KeyError, TypeError):
            lines.append(f"{path}: does not say with which settings it was run: {way_out}")
            continue
        now, written = (dict(flat_settings(physics(recipes, slurry))) for recipes in (wet, config))
        for key in dict.fromkeys([*now, *before]):
            if key not in now or key not in before or now[key] != before[key]:
                was = f"with {key} = {shown(before[key])}" if key in before else f"without {key}"
                has = shown_wet(key, now, written) if key in now else "none"
                # a setting that all slurries share is one difference
                owner = slurry.id if key.startswith("slurry.") else ""
                line = f"{results}: the DEM of slurry {slurry.id} was run {was}, the configuration has {has}"
                differences.setdefault((owner, key), line)
    if differences:
        first, *others = differences.values()
        more = f" (and {len(others)} more)" if others else ""
        lines.append(f"{first}{more}: {way_out}")
    return lines
