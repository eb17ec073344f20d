"""How every script starts and ends: options, input files that are what was written, errors that fit on one line."""

import argparse
import json
import os
import signal
import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from slurrycast.runtime.environment import isolate_libraries
from slurrycast.runtime.files import InputError, RunError, Unfinished, check_unchanged

EXIT_UNFINISHED = 75  # EX_TEMPFAIL of sysexits.h: nothing is wrong, the same command goes on


class Parser(argparse.ArgumentParser):
    """Options of a script whose help is its docstring; a wrong one ends with one line and exit code 2."""

    def __init__(self, description: str) -> None:
        super().__init__(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
        self._checks: list[Callable[[Namespace], str | None]] = []

    def parse_args(self, *words: Any) -> Namespace:
        """Read the options and check those that have to fit together."""
        args = super().parse_args(*words)
        for check in self._checks:
            if problem := check(args):
                self.error(problem)
        return args

    def error(self, message: str) -> NoReturn:
        """Leave without the usage, which would hide the line."""
        self.exit(2, f"error: {message}\n")

    def add_input(self, option: str, content: str, **keywords: Any) -> None:
        """Add an option for an input file, which has to be there and undamaged; required unless nargs is "*"."""
        defaults = {"default": []} if keywords.get("nargs") == "*" else {"required": True}
        self.add_argument(option, help=f"in: {content}", **{"type": input_file} | defaults | keywords)

    def add_output(self, option: str, content: str, **keywords: Any) -> None:
        """Add an option for the path of an output, required by default."""
        self.add_argument(option, help=f"out: {content}", type=Path, **{"required": True} | keywords)

    def add_value(self, option: str, meaning: str, **keywords: Any) -> None:
        """Add an option for a value that is no file, required unless it has a default."""
        self.add_argument(option, help=meaning, **{"required": "default" not in keywords} | keywords)

    def add_tables(self, *names: str) -> None:
        """Add a required option for each of these tables of the workflow, such as --front for `front`."""
        for name in names:
            self.add_input(_option(name), f"tables/{name}.csv")

    def add_lammps(self, group: argparse._ArgumentGroup | None = None) -> None:
        """Add the options that say how LAMMPS is started, to a group of options if there is one."""
        options = group or self
        options.add_argument("--executable", default="lmp", help="LAMMPS: a name on PATH or a path")
        options.add_argument("--launcher", default="mpiexec", help="put before the executable when ranks > 1")
        options.add_argument("--ranks", default=1, type=int, help="MPI ranks")

    def add_predictions(self, *, required: bool) -> None:
        """Add predicted structures, as many DEM frames that they are compared with, and the number of the frame."""
        nargs = "+" if required else "*"
        self.add_input("--predicted", "predicted structures (HDF5)", nargs=nargs)
        self.add_input("--frames", "DEM frames (HDF5), one for each --predicted, in order", nargs=nargs)
        self.add_value("--target-frame", "number of the DEM frame to compare with", type=int)
        self.one_each("predicted", "frames")

    def add_target(self) -> None:
        """Add DEM frames and the number of the one that a structure is compared with; neither for a new slurry."""
        self.add_input("--frames", "DEM frames with the target (HDF5); leave out for a new slurry", required=False)
        self.add_value("--target-frame", "number of the frame of --frames", type=int, default=None)
        alone = "--frames and --target-frame go together"
        self.add_check(lambda args: alone if (args.frames is None) != (args.target_frame is None) else None)

    def add_check(self, problem: Callable[[Namespace], str | None]) -> None:
        """End with the line that `problem` returns for the options, if it returns one."""
        self._checks.append(problem)

    def needs(self, options: Callable[[Namespace], Sequence[str]]) -> None:
        """End with a line if one of the `options` that --surrogate needs is missing."""

        def problem(args: Namespace) -> str | None:
            missing = [_option(name) for name in options(args) if getattr(args, name) is None]
            return f"{args.surrogate} needs {', '.join(missing)}" if missing else None

        self.add_check(problem)

    def one_each(self, one: str, other: str) -> None:
        """End with a line unless the options of these two names are given equally many values."""

        def problem(args: Namespace) -> str | None:
            n_one, n_other = len(getattr(args, one)), len(getattr(args, other))
            equal = n_one == n_other
            return None if equal else f"{n_one} {_option(one)} but {n_other} {_option(other)}: one each is needed"

        self.add_check(problem)

    def as_many_of_each(self, *names: str) -> None:
        """End with a line unless the options of all these names are given equally many values."""
        listed = " and ".join([", ".join(map(_option, names[:-1])), _option(names[-1])])
        problem = f"{listed}: as many of each are needed"
        self.add_check(lambda args: problem if len({len(getattr(args, name)) for name in names}) > 1 else None)


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


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


def printable(line: str) -> str:
    """A line in which characters that end lines or control a terminal are escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)


def parse(add_options: Callable[[Parser], None], description: str, words: Sequence[str] | None = None) -> Namespace:
    """Read the options of a script from `words`, by default those of the command line."""
    parser = Parser(description)
    add_options(parser)
    return parser.parse_args(words)


def run_main(main: Callable[[Namespace], None], add_options: Callable[[Parser], None], description: str) -> None:
    """Run a script: read the options that `add_options` adds, and call `main` with them.

    Bad input, a failed run or a full disk ends with one line on stderr and exit code 1.
    Exit code 75 if the run stopped on purpose before it was done. Lines appear as they are printed, also where the
    output is not a terminal but a log.
    """
    isolate_libraries(os.environ)
    sys.stdout.reconfigure(line_buffering=True, errors="backslashreplace")  # whatever the user's encoding
    # As an exception, so that what was started is stopped as well: LAMMPS must not write on beside the next attempt.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        main(parse(add_options, description))
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
