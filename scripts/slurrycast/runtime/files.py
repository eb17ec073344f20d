"""Outputs that appear whole or not at all and whose damage is noticed."""

import contextlib
import glob
import hashlib
import io
import os
import re
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import h5py

CHECKSUMS = ".checksums"  # folder beside the files, with one file for each, as `sha256sum -c` reads it
# Names of folders with files that no other job reads: logs, checksums and work folders.
PASSED_OVER = re.compile(rf"logs|{re.escape(CHECKSUMS)}|work.*|.*_work")
VERSIONS_VARIABLE = "SLURRYCAST_VERSIONS"  # of the environment: name of the versions with which outputs are made


class InputError(ValueError):
    """Input that cannot be used: the message names the file or key, the value and what is allowed, on one line."""


class RunError(RuntimeError):
    """A program or a training that failed: the message says what it said and where its log is, on one line."""


class Unfinished(Exception):
    """A run that stopped on purpose, at a place from which the same command goes on; the message says why."""


def checksum(path: str | Path) -> str:
    """SHA-256 of a file's content, in hexadecimal digits."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _checksum_file(path: Path) -> Path:
    return path.parent / CHECKSUMS / f"{path.name}.sha256"


def _part(path: Path) -> Path:
    """Where this process writes what is to become `path`; what killed ones have left there is removed.

    Its own, since a process whose workflow was killed may still be about to write the same file.
    """
    here = socket.gethostname()
    pattern = f".{glob.escape(path.stem)}.*.part{glob.escape(path.suffix)}"
    for left in (*path.parent.glob(pattern), *path.parent.glob(f"{CHECKSUMS}/{pattern}.sha256")):
        host, _, pid = left.name[len(path.stem) + 2 :].partition(f".part{path.suffix}")[0].rpartition("-")
        if host == here and pid.isdecimal() and not Path("/proc", pid).exists():
            left.unlink(missing_ok=True)
    return path.with_name(f".{path.stem}.{here}-{os.getpid()}.part{path.suffix}")


@contextlib.contextmanager
def moved_into_place(path: str | Path) -> Iterator[Path]:
    """Yield a path beside `path` to write to; move it to `path` when the block ends without an error.

    No reader ever meets a half-written file, and an earlier `path` survives a failure. The suffix stays the same, since
    some libraries choose the format by it. The checksum is kept for `check_unchanged`. A full disk and the like is an
    OSError that names `path`.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = _part(path)
    kept = _checksum_file(path)
    written = kept.with_name(f"{part.name}.sha256")
    try:
        yield part
        line = f"{checksum(part)}  {path.name}\n"
        if versions := os.environ.get(VERSIONS_VARIABLE):
            line += f"# versions {versions}\n"
        kept.parent.mkdir(exist_ok=True)
        written.write_text(line, encoding="utf-8")
        # A kill between these leaves a file without checksum, never one with that of another content.
        kept.unlink(missing_ok=True)
        os.replace(part, path)
        os.replace(written, kept)
    except OSError as error:
        if error.errno is None or error.filename not in (None, str(part), part):
            raise
        raise OSError(error.errno, os.strerror(error.errno), str(path)) from error
    finally:
        part.unlink(missing_ok=True)
        written.unlink(missing_ok=True)


class _Unfailing(io.FileIO):
    """A file whose writes always seem to succeed; `failure` is the first error."""

    failure: OSError | None = None

    def write(self, data) -> int:
        """Write all of `data`; return its length in any case."""
        left = memoryview(data).cast("B")
        n_bytes = len(left)
        try:
            while left:
                left = left[super().write(left) :]
        except OSError as error:
            self.failure = self.failure or error
        return n_bytes


@contextlib.contextmanager
def hdf5_moved_into_place(path: str | Path) -> Iterator["h5py.File"]:
    """Yield an HDF5 file to write to, and move it to `path` as `moved_into_place` does.

    HDF5 does not get over a write that fails: it complains for each object that it cannot flush, and may crash. So it
    learns nothing of a full disk, and the error is raised when it has closed the file.
    """
    import h5py

    with moved_into_place(path) as part, _Unfailing(part, "w+") as raw:
        try:
            with h5py.File(raw, "w") as file:
                yield file
        finally:
            if raw.failure:
                raise raw.failure


def check_unchanged(path: str | Path) -> None:
    """Refuse, with InputError, a file that is missing or has another content than `moved_into_place` gave it.

    Files that were not written by it have no checksum and pass.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        expected = _checksum_file(path).read_text(encoding="utf-8").split()[0]
    except (OSError, ValueError, IndexError):
        return
    if checksum(path) != expected:
        raise InputError(
            f"{path}: not what was written there, it is damaged or was edited (sha256 differs from "
            f"{_checksum_file(path)}): delete it, and the workflow makes it anew"
        )


def damaged_files(folder: str | Path) -> Iterator[str]:
    """Yield a line for each output at any depth of `folder` that `check_unchanged` refuses.

    And one line for all whose checksum is missing. Logs and work folders are left out.
    """
    without = []
    for path in sorted(Path(folder).rglob("*")):
        folders = path.relative_to(folder).parts[:-1]
        if any(map(PASSED_OVER.fullmatch, folders)) or path.name.startswith(".") or not path.is_file():
            continue
        try:
            check_unchanged(path)
        except InputError as error:
            yield str(error)
        if not _checksum_file(path).exists():
            without.append(path)
    if without:
        more = f" (and {len(without) - 1} more files)" if without[1:] else ""
        yield f"{without[0]}{more}: no checksum in {CHECKSUMS}/ beside it: copy these hidden folders too"


def write_text(path: str | Path, text: str) -> None:
    """Write `text` to `path` in one move (UTF-8)."""
    with moved_into_place(path) as part:
        part.write_text(text, encoding="utf-8")
