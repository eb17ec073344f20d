"""Shared by the tests of the configuration."""

from pathlib import Path

import pytest

from configurations import copy_tables, load


@pytest.fixture
def in_empty_project(tmp_path, monkeypatch) -> Path:
    """A working directory with the shipped slurry tables and no results."""
    copy_tables(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def config() -> dict:
    """The shipped configuration."""
    return load("config")
