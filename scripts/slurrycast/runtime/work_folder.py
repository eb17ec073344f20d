"""Work folders: what a job that was cut off had finished, from which the next attempt goes on, never two at a time."""

import contextlib
import errno
import fcntl
import io
import json
import os
import shutil
import socket
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import psutil

from slurrycast.runtime.files import RunError, check_unchanged, checksum, write_text

LOCK = "lock"
IDENTITY = "identity"
LOCK_WAIT_S = 60.0  # LAMMPS whose driver was killed ends when it prints its next line


class WorkFolder:
    """A folder that this process holds the lock of; `records` tell which parts of the job are finished."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def record(self, part: str, files: Sequence[str], cost: dict[str, float]) -> None:
        """Note that `part` is finished, with the checksums of the `files` that it left and what it cost."""
        sums = {name: checksum(self.path / name) for name in files}
        write_text(self.path / f"{part}.json", json.dumps({**cost, "files": sums}))

    def finished(self, part: str) -> bool:
        """Whether `part` is finished and its files are what it left; says so if they are not."""
        record = self.path / f"{part}.json"
        if not record.exists():
            return False
        try:
            check_unchanged(record)
            sums = dict(json.loads(record.read_text(encoding="utf-8"))["files"])
        except (ValueError, KeyError, TypeError):
            print(f"{record}: damaged: {part} is done again")
            return False
        for name, expected in sums.items():
            path = self.path / name
            if not path.is_file() or checksum(path) != expected:
                print(f"{path}: truncated, or not what {part} left: {part} is done again")
                return False
        return True

    def cost(self, part: str) -> dict[str, float]:
        """Wall and CPU seconds of a finished part."""
        record = json.loads((self.path / f"{part}.json").read_text(encoding="utf-8"))
        return {clock: record[clock] for clock in ("wall_s", "cpu_s")}

    def forget(self, part: str) -> None:
        """Take a part for not finished, since one before it has to be done again."""
        (self.path / f"{part}.json").unlink(missing_ok=True)


@contextlib.contextmanager
def work_folder(path: Path, identity: str | None = None) -> Iterator[WorkFolder]:
    """Lock the folder for the block.

    One that was left by a job with another `identity` is emptied first. Without `identity` it always is, and it is
    removed when the block ends without an error. RunError if another process goes on holding the lock. Children
    started with `close_fds=False` hold it too, so it outlives this process with them: killed drivers leave LAMMPS
    behind, which must not write beside the next attempt.
    """
    path.mkdir(parents=True, exist_ok=True)
    lock = _locked(path)
    try:
        known = path / IDENTITY
        if identity is None or not known.exists() or known.read_text(encoding="utf-8") != identity:
            left = [item for item in path.iterdir() if item.name != LOCK]
            if left and identity is not None:
                print(f"{path}: left by a run with other inputs; starting anew")
            for item in left:
                if item.is_dir():
                    shutil.rmtree(item)
                else:
                    item.unlink()
            if identity is not None:
                write_text(known, identity)
        yield WorkFolder(path)
        if identity is None:
            shutil.rmtree(path)
    finally:
        os.close(lock)


def _locked(folder: Path) -> int:
    """Open and lock `folder`/lock; the lock is gone with the last process that holds the file open."""
    file, start, told = folder / LOCK, time.monotonic(), False
    while True:
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = _holder(file)
            os.close(descriptor)
            if time.monotonic() - start > LOCK_WAIT_S:
                raise RunError(
                    f"{folder}: in use by {holder}: wait until it has ended or end it; nothing was changed"
                ) from None
            if not told:
                print(f"{folder}: in use by {holder}; waiting up to {LOCK_WAIT_S:.0f} s", flush=True)
                told = True
            time.sleep(0.2)
            continue
        except OSError as error:
            if error.errno not in (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP):
                raise
            print(f"{folder}: this file system has no locks; make sure that no other process writes there")
        # the holder before may have removed the folder with the lock file that was waited for
        try:
            current = file.stat().st_ino == os.fstat(descriptor).st_ino
        except FileNotFoundError:
            folder.mkdir(parents=True, exist_ok=True)
            current = False
        if current:
            break
        os.close(descriptor)
    os.ftruncate(descriptor, 0)
    os.write(descriptor, json.dumps({"pid": os.getpid(), "host": socket.gethostname()}).encode())
    os.set_inheritable(descriptor, True)
    return descriptor


def _holder(file: Path) -> str:
    """Who holds the lock, in words: the processes of this machine that have the file open, or what the file says."""
    holders, inode = [], file.stat().st_ino
    for process in psutil.process_iter(["pid", "name"]):
        with contextlib.suppress(psutil.Error, OSError):
            opened = (link.stat().st_ino for link in Path(f"/proc/{process.pid}/fd").iterdir())
            if process.pid != os.getpid() and inode in opened:
                holders.append(f"{process.info['name']} (pid {process.pid})")
    if holders:
        return ", ".join(holders)
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        owner = json.loads(file.read_text(encoding="utf-8"))
        return f"a process of {owner['host']} (started by pid {owner['pid']} there)"
    return "another process"


class _Both(io.TextIOBase):
    """Writes to two streams; one that nobody reads any more does not matter: signals end the reader of a log too."""

    def __init__(self, first: io.TextIOBase, second: io.TextIOBase) -> None:
        self._streams = (first, second)

    def write(self, text: str) -> int:
        for stream in self._streams:
            with contextlib.suppress(BrokenPipeError):
                stream.write(text)
        return len(text)

    def flush(self) -> None:
        for stream in self._streams:
            with contextlib.suppress(BrokenPipeError):
                stream.flush()


@contextlib.contextmanager
def attempt_log(folder: Path) -> Iterator[Path]:
    """Keep what the block prints, and how it ended, in `folder`/attempt_<n>.log, besides printing it; yield that path.

    The workflow deletes a job's own log when it tries again.
    """
    folder.mkdir(parents=True, exist_ok=True)
    numbers = [int(log.stem.split("_")[1]) for log in folder.glob("attempt_*.log")]
    log = folder / f"attempt_{max(numbers, default=0) + 1}.log"
    with log.open("w", encoding="utf-8", buffering=1) as file, contextlib.redirect_stdout(_Both(sys.stdout, file)):
        file.write(f"{time.strftime('%Y-%m-%d %H:%M:%S')} on {socket.gethostname()}, pid {os.getpid()}\n")
        try:
            yield log
        except BaseException as error:
            file.write(f"{type(error).__name__}: {error}\n")
            raise
