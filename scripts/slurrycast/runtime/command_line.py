"""How every script starts and ends: options, input files that are what was written, errors that fit on one line."""

import argparse
import json
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from slurrycast.runtime.files import InputError, RunError, Unfinished, check_unchanged

EXIT_UNFINISHED = 75  # EX_TEMPFAIL of sysexits.h: nothing is wrong, the same command goes on


class Parser(argparse.ArgumentParser):
    """Options of a script whose help is its docstring; a wrong one ends with one line and exit code 2."""

    def __init__(self, description: str) -> None:
        super().__init__(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)

    def error(self, message: str) -> NoReturn:
        """Leave without the usage, which would hide the line."""
        self.exit(2, f"error: {message}\n")

    def add_input(self, option: str, content: str, **keywords: Any) -> None:
        """Add an option for an input file, which has to be there and undamaged; required unless nargs is "*"."""
        defaults = {"default": []} if keywords.get("nargs") == "*" else {"required": True}
        self.add_argument(option, help=f"in: {content}", type=input_file, **defaults | keywords)

    def add_output(self, option: str, content: str, **keywords: Any) -> None:
        """Add an option for the path of an output, required by default."""
        self.add_argument(option, help=f"out: {content}", type=Path, **{"required": True} | keywords)

    def add_lammps(self, group: argparse._ArgumentGroup | None = None) -> None:
        """Add the options that say how LAMMPS is started, to a group of options if there is one."""
        options = group or self
        options.add_argument("--executable", default="lmp", help="LAMMPS: a name on PATH or a path")
        options.add_argument("--launcher", default="mpiexec", help="put before the executable when ranks > 1")
        options.add_argument("--ranks", default=1, type=int, help="MPI ranks")

    def add_predictions(self, *, required: bool) -> None:
        """Predicted structures beside the DEM frames that they are compared with; see `one_each`."""
        nargs = "+" if required else "*"
        self.add_input("--predicted", "predicted structures (HDF5)", nargs=nargs)
        self.add_input("--frames", "DEM frames (HDF5), one for each --predicted, in order", nargs=nargs)
        self.add_argument("--target-frame", type=int, required=True, help="number of the DEM frame to compare with")

    def one_each(self, args: argparse.Namespace, one: str, other: str) -> None:
        """End with a line unless the options of these two names were given equally many values."""
        n_one, n_other = len(getattr(args, one)), len(getattr(args, other))
        if n_one != n_other:
            self.error(f"{n_one} --{one} but {n_other} --{other}: one each is needed")


def input_file(text: str) -> Path:
    """Path of an input, as the `type` of an option; refused if it is missing or not what was written there.

    A JSON file has to hold a mapping.
    """
    path = Path(text)
    try:
        check_unchanged(path)
        if path.suffix == ".json" and not isinstance(json.loads(path.read_text(encoding="utf-8")), dict):
            raise InputError(f"{text}: not a JSON mapping")
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    except (ValueError, RecursionError) as error:
        raise argparse.ArgumentTypeError(f"{text}: not readable JSON ({error})") from None
    return path


def named_file(text: str) -> tuple[str, Path]:
    """Take `name=path` of an input apart, as the `type` of an option."""
    name, equals, path = text.partition("=")
    if not (name and equals and path):
        raise argparse.ArgumentTypeError(f"{text!r} is not name=path")
    return name, input_file(path)


def run_main(main: Callable[[], None]) -> None:
    """Run a script's `main`; bad input, a failed run or a full disk ends with one line on stderr and exit code 1.

    Exit code 75 if the run stopped on purpose before it was done. Lines appear as they are printed, also where the
    output is not a terminal but a log.
    """
    sys.stdout.reconfigure(line_buffering=True)
    # As an exception, so that what was started is stopped as well: LAMMPS must not write on beside the next attempt.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        main()
    except (InputError, RunError) as error:
        sys.exit(f"error: {error}")
    except Unfinished as error:
        print(error, file=sys.stderr)
        sys.exit(EXIT_UNFINISHED)
    except OSError as error:
        if error.errno is None:  # of a library, with a meaning of its own
            raise
        place = " to ".join(str(name) for name in (error.filename, error.filename2) if name is not None)
        sys.exit(f"error: {place or 'a file'}: {error.strerror}; what was finished before is kept")
