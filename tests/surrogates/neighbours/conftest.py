"""One trained model for all tests of the package."""

import pytest
from slurries import SETTINGS, train


@pytest.fixture(scope="session")
def model(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trained")
    train(SETTINGS, folder)
    return folder / "model.keras"
