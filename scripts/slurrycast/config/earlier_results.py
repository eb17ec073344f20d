"""Results of an earlier run, or of another machine, that are to be taken for results of this one."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from slurrycast.config.formulations import wet_recipes
from slurrycast.config.physics import DEM_START, flat_settings, shown_wet
from slurrycast.config.schema_errors import shown
from slurrycast.config.slurry_table import Slurry, read_slurry_table
from slurrycast.config.yaml_files import file_problems
from slurrycast.dem.neighbour_lists import skin_um
from slurrycast.dem.recipe import particle_types
from slurrycast.runtime.files import damaged_files

NOT_RESULTS = {"run.overwrite", *(f"dem.{key}" for key in DEM_START)}  # settings that no result depends on
CONFIG, SLURRIES = "config.yaml", "slurries.tsv"  # what record_run writes


def problems(config: Mapping, slurries: Sequence[Slurry], results: str | Path) -> Iterator[str]:
    """Check whether the results can be taken over as they are: whole, of this configuration and slurry table.

    Both configurations are those that their users wrote; they are compared with the composition of the slurry.
    Yields a line for each damaged file, for the first of all settings that differ, and for slurries that differ.
    """
    yield from damaged_files(results)
    recorded, table = Path(results, CONFIG), Path(results, SLURRIES)
    missing = [path for path in (recorded, table) if not path.is_file()]
    if missing:  # a DEM says in its run.json with which settings it was made, others do not
        if any(Path(results, name).exists() for name in ("dataset", "models", "hybrid", "tables")):
            yield f"{missing[0]}: no such file: without it nothing tells with which settings the results were made"
        return
    if lines := file_problems(recorded):
        yield from lines
        return
    way_out = f"take them over with --configfile {recorded}, and change settings afterwards"
    try:
        before = dict(flat_settings(wet_recipes(yaml.safe_load(recorded.read_text(encoding="utf-8")))))
    except (KeyError, TypeError, AttributeError):
        yield f"{recorded}: is not the configuration of a run"
        return
    now, written = (dict(flat_settings(recipes)) for recipes in (wet_recipes(config), config))
    if before.get("dem.skin_um") is not None:  # also of runs of before it followed from the recipe
        now["dem.skin_um"] = skin_um(config["dem"], particle_types(config["formulation"]["phases"]))
    nothing = object()
    pairs = {key: (now.get(key, nothing), before.get(key, nothing)) for key in dict.fromkeys([*now, *before])}
    differing = [key for key, pair in pairs.items() if key not in NOT_RESULTS and not _same(*pair)]
    if differing:
        key, *others = differing
        was = shown(before[key]) if key in before else "nothing"
        has = shown_wet(key, now, written) if key in now else "nothing"
        more = f" (and {len(others)} more)" if others else ""
        yield f"{results}: made with {key} = {was}, the configuration has {has}{more}: {way_out}"
    if read_slurry_table(table)[0] != list(slurries):
        yield f"{table}: the slurries that the results were made with are not those of {config['slurries']}"


def _same(now: Any, before: Any) -> bool:
    """Whether two settings are equal; what follows from shares of a tape may differ in its last digit."""
    both = isinstance(now, float) and isinstance(before, float)
    return math.isclose(now, before, rel_tol=1e-12) if both else now == before


def reaches(run: str | Path, last_frame: int) -> bool:
    """Whether `run`, the run.json of a DEM, says that it got to `last_frame`."""
    try:
        return json.loads(Path(run).read_text(encoding="utf-8"))["frames_written"] > last_frame
    except (OSError, ValueError, KeyError, TypeError):
        return False
