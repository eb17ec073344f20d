"""Results of an earlier run, or of another machine, that are to be taken for results of this one."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path

import yaml

from slurrycast.config.physics import DEM_START, flat_settings
from slurrycast.config.schema_errors import shown
from slurrycast.runtime.files import damaged_files

NOT_RESULTS = {"run.overwrite", *(f"dem.{key}" for key in DEM_START)}  # settings that no result depends on


def problems(config: Mapping, results: str | Path) -> Iterator[str]:
    """Check whether the results can be taken over as they are: whole, and made with this configuration.

    Yields one line for each damaged file, and one for all settings that differ from `config.yaml` of the results.
    """
    yield from damaged_files(results)
    recorded = Path(results, "config.yaml")
    if not recorded.exists():
        return
    before = dict(flat_settings(yaml.safe_load(recorded.read_text(encoding="utf-8"))))
    now = dict(flat_settings(config))
    missing = object()
    differing = [key for key in dict.fromkeys([*now, *before]) if now.get(key, missing) != before.get(key, missing)]
    differing = [key for key in differing if key not in NOT_RESULTS]
    if differing:
        key, *others = differing
        was, has = (shown(settings[key]) if key in settings else "nothing" for settings in (before, now))
        more = f" (and {len(others)} more)" if others else ""
        yield (
            f"{results}: made with {key} = {was}, the configuration has {has}{more}: take them over with --configfile "
            f"{recorded}, and change settings afterwards"
        )


def ends_at(run: str | Path, last_frame: int) -> bool:
    """Whether `run`, the run.json of a DEM, says that it ended at `last_frame`."""
    try:
        return json.loads(Path(run).read_text(encoding="utf-8"))["frames_written"] == last_frame + 1
    except (OSError, ValueError, KeyError, TypeError):
        return False
