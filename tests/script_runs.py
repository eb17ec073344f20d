"""Scripts as their command lines run them, but in this process: a new one would spend seconds on its imports."""

import contextlib
import io
import json
import runpy
import signal
import sys
from dataclasses import asdict
from pathlib import Path
from subprocess import CompletedProcess
from types import ModuleType
from unittest.mock import patch

import pandas as pd

from configurations import ROOT
from slurrycast.data.tables import read_table
from slurrycast.runtime.command_line import run_main
from slurrycast.runtime.costs import Cost


def run_script(script: str | ModuleType, **options: object) -> CompletedProcess:
    """Run a script by its name, or one that is imported and in part replaced: what it prints, and its exit code."""
    name = script if isinstance(script, str) else script.__name__
    words = [name]
    for option, value in options.items():
        words += [f"--{option.replace('_', '-')}", *map(str, value if isinstance(value, list | tuple) else [value])]
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    code, handler = 0, signal.getsignal(signal.SIGTERM)
    with patch.object(sys, "argv", words), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            if isinstance(script, str):
                (path,) = ROOT.glob(f"scripts/*/{script}.py")
                runpy.run_path(str(path), run_name="__main__")
            else:
                run_main(script.main, script.add_options, script.__doc__)
        except SystemExit as end:
            code = end.code or 0
            if isinstance(code, str):
                print(code, file=err)
                code = 1
        finally:
            signal.signal(signal.SIGTERM, handler)
    return CompletedProcess(words, code, *(stream.buffer.getvalue().decode() for stream in (out, err)))


def written(script: str | ModuleType, table: Path, **options: object) -> pd.DataFrame:
    """The table that a script writes."""
    done = run_script(script, **options, table=table)
    assert done.returncode == 0, done.stderr
    return read_table(table)


def refusal(script: str | ModuleType, table: Path, **options: object) -> str:
    """What a script says that refuses its input and writes no table."""
    done = run_script(script, **options, table=table)
    assert (done.returncode, table.exists()) == (1, False)
    return done.stderr


def write_costs(folder: Path, costs: list[Cost]) -> list[Path]:
    """Write the records of stages as the scripts do; their paths."""
    paths = [folder / f"cost_{place}.json" for place in range(len(costs))]
    for path, cost in zip(paths, costs, strict=True):
        path.write_text(json.dumps(asdict(cost)))
    return paths
