"""File systems without locks, such as NFS without a lock daemon."""

import errno
import os
import shutil
import subprocess
from pathlib import Path

import pytest

WITHOUT_LOCKS = """
#include <errno.h>
#include <stdlib.h>
int flock(int descriptor, int operation) { errno = atoi(getenv("ERRNO_OF_FLOCK")); return -1; }
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory) -> Path:
    """A library in whose processes no file can be locked."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler, with which a file system without locks is played")
    folder = tmp_path_factory.mktemp("library")
    (folder / "without_locks.c").write_text(WITHOUT_LOCKS)
    library = folder / "without_locks.so"
    subprocess.run([compiler, "-shared", "-fPIC", "-o", library, folder / "without_locks.c"], check=True)
    return library


@pytest.mark.parametrize("error", [errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS])
def test_frames_are_made_and_read_there(library, slurry, tmp_path, command, dem_command, error):
    """And where the user asks HDF5 for locks."""
    environment = os.environ | {"LD_PRELOAD": str(library), "ERRNO_OF_FLOCK": str(error)}
    environment["HDF5_USE_FILE_LOCKING"] = "TRUE"

    def run(words: list[str]) -> str:
        done = subprocess.run(words, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert done.returncode == 0, done.stdout
        return done.stdout

    assert "this file system has no locks" in run(dem_command(slurry, tmp_path, 10))
    files = {"run": "run.json", "frames": "frames.h5", "cost": "cost.json", "work": "work"}
    paths = {name: tmp_path / file for name, file in files.items()}
    run(command("extract_frames", dump=tmp_path / "dump.lammpstrj", inputs=slurry / "inputs.json", **paths))
