"""Shared by all tests: the package beside the scripts, and where the project's files are."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "scripts"))


@pytest.fixture
def root() -> Path:
    """The project folder."""
    return ROOT
