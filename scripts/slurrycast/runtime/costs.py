"""What a stage costs: wall and CPU seconds and peak memory, of the process and of all that it started."""

import contextlib
import json
import resource
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import psutil

from slurrycast.runtime.files import write_text


@dataclass
class Cost:
    """One row of tables/cost.csv. `particles` and `steps` (of the DEM) are filled in by the stage where it has them."""

    stage: str
    surrogate: str = "-"
    slurry: str = "-"
    particles: int | None = None
    steps: int | None = None
    wall_s: float = 0.0
    cpu_s: float = 0.0
    max_rss_mb: float = 0.0


def children_cpu_s() -> float:
    """CPU seconds of all child processes so far that this process has waited for."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def spent_so_far() -> dict[str, float]:
    """Wall and CPU seconds of this process since its start, child processes that it has waited for included."""
    wall_s = time.time() - psutil.Process().create_time()
    return {"wall_s": wall_s, "cpu_s": time.process_time() + children_cpu_s()}


@contextlib.contextmanager
def measured_cost(path: str | Path, stage: str, surrogate: str = "-", slurry: str = "-") -> Iterator[Cost]:
    """Measure the block and write the record to `path` (JSON) if it ends without an error.

    Both times are those of the whole process, start-up and imports included. CPU seconds hold the child processes that
    it waited for (LAMMPS) too, which a sampling profiler misses. Peak memory is the largest single process in MB. The
    block may add what earlier attempts of a resumed job have spent.
    """
    cost = Cost(stage, surrogate, slurry)
    yield cost
    spent = spent_so_far()
    cost.wall_s += spent["wall_s"]
    cost.cpu_s += spent["cpu_s"]
    peaks_kb = (resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    cost.max_rss_mb = max(peaks_kb) / 1024
    write_text(path, json.dumps(asdict(cost), indent=1) + "\n")


def read_cost(path: str | Path) -> Cost:
    """Read what `measured_cost` wrote."""
    return Cost(**json.loads(Path(path).read_text(encoding="utf-8")))
