"""What figures show, for tests of the scripts that draw them."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from slurrycast.report.figures import save_figure


def is_drawn(path: Path) -> bool:
    """Whether a picture shows something: a good share of its pixels differs from the background."""
    pixels = imread(path)[..., :3]
    return pixels.std() > 0.02 and np.mean(np.any(pixels < 0.9, axis=-1)) > 0.01


def check_saved(figure: Figure, path: Path) -> None:
    """Write a figure and look whether the picture shows something."""
    save_figure(figure, path)
    assert is_drawn(path)


def recorded_calls(monkeypatch: pytest.MonkeyPatch, script: ModuleType, function: str) -> list[tuple]:
    """What a function of a script is called with and returns, (arguments, result), from now on."""
    calls, original = [], getattr(script, function)

    def record(*arguments: object) -> object:
        calls.append((arguments, original(*arguments)))
        return calls[-1][1]

    monkeypatch.setattr(script, function, record)
    return calls


def texts(items: list) -> list[str]:
    """Texts of what Matplotlib calls texts, of axes or a legend."""
    return [item.get_text() for item in items]
