"""Outputs that appear whole or not at all, and errors that fit on one line."""

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path


class InputError(ValueError):
    """Input that cannot be used: the message names the file or key, the value and what is allowed, on one line."""


class RunError(RuntimeError):
    """A program or a training that failed: the message says what it said and where its log is, on one line."""


@contextlib.contextmanager
def moved_into_place(path: str | Path) -> Iterator[Path]:
    """Yield a path beside `path` to write to; move it to `path` when the block ends without an error.

    No reader ever meets a half-written file, and an earlier `path` survives a failure. The suffix stays the same, since
    some libraries choose the format by it.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write `text` to `path` in one move (UTF-8)."""
    with moved_into_place(path) as part:
        part.write_text(text, encoding="utf-8")


def run_main(main: Callable[[], None]) -> None:
    """Run a script's `main`; bad input or a failed run ends with one line on stderr and exit code 1.

    Lines appear as they are printed, also where the output is not a terminal but a log.
    """
    sys.stdout.reconfigure(line_buffering=True)
    # As an exception, so that what was started is stopped as well: LAMMPS must not write on beside the next attempt.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        main()
    except (InputError, RunError) as error:
        sys.exit(f"error: {error}")
