"""When a run ends on purpose: a clock that is set by hand, and signals."""

import os
import signal
from types import SimpleNamespace

import pytest

from slurrycast.runtime import stopping
from slurrycast.runtime.files import Unfinished
from slurrycast.runtime.stopping import Stop


@pytest.fixture
def clock(monkeypatch):
    """Seconds since the process was started; the handlers of the test process come back afterwards."""
    now = [0.0]

    monkeypatch.setattr(stopping.time, "time", lambda: now[0])
    monkeypatch.setattr(stopping.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(stopping.psutil, "Process", lambda: SimpleNamespace(create_time=lambda: 0.0))
    handlers = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGUSR1, signal.SIGALRM)}
    yield now
    signal.alarm(0)
    for number, handler in handlers.items():
        signal.signal(number, handler)


def run_segments(stop: Stop, clock: list[float], count: int, seconds: float) -> None:
    """Segments of 1000 steps each."""
    for first in range(0, 1000 * count, 1000):
        stop.begin(first, first + 1000)
        clock[0] += seconds
        stop.reached(first + 1000)


@pytest.mark.parametrize(
    ("budget_s", "segment_s", "count", "shorter_fits"),
    [
        (160, 20, 4, True),  # of which 60 s are kept for the start and the end of the job
        (40, 4, 2, True),  # of which half is kept
        (5, 1, 1, False),  # a first segment begins whatever the budget
    ],
)
def test_segments_begin_as_long_as_they_fit(clock, budget_s, segment_s, count, shorter_fits):
    """1.2 times the time of the last one has to be left, here after 10 s that were gone before the first."""
    stop = Stop("6", float(budget_s))
    clock[0] = 10.0
    run_segments(stop, clock, count, segment_s)
    end = 1000 * count
    with pytest.raises(Unfinished) as error:
        stop.begin(end, end + 1000)
    assert str(error.value) == (
        f"[6] stopped at step {end}: the next segment takes about {1.2 * segment_s:.0f} s, "
        f"and {10 + count * segment_s} of {budget_s} s are gone: the same command goes on"
    )
    if shorter_fits:
        stop.begin(end, end + 100)


def test_no_budget_is_no_limit(clock):
    run_segments(Stop("6", budget_s=0.0), clock, 3, 1e6)


@pytest.mark.parametrize(
    ("number", "step", "given_up"),
    [
        (signal.SIGTERM, 100, True),  # 90 s left
        (signal.SIGTERM, 0, True),  # not known
        (signal.SIGTERM, 900, False),  # 1.1 s left
        (signal.SIGUSR1, 100, False),
        (signal.SIGUSR1, 0, False),
    ],
)
def test_signals(clock, number, step, given_up):
    stop = Stop("6", budget_s=0.0)
    stop.begin(0, 1000)
    clock[0] += 10.0
    stop.reached(step)
    if given_up:
        with pytest.raises(Unfinished, match=f"stopped by {number.name} amid a segment: the same command goes on"):
            os.kill(os.getpid(), number)
    else:
        os.kill(os.getpid(), number)
    assert stop.asked == number.name
    with pytest.raises(Unfinished, match=f"stopped at step 1000 by {number.name}: the same command goes on"):
        stop.begin(1000, 2000)


def test_segment_that_hangs_is_given_up_all_the_same(clock, monkeypatch):
    monkeypatch.setattr(stopping, "GRACE_S", 1)
    stop = Stop("6", budget_s=0.0)
    stop.begin(0, 1000)
    clock[0] += 10.0
    stop.reached(1000)
    os.kill(os.getpid(), signal.SIGTERM)
    with pytest.raises(Unfinished, match="stopped by SIGTERM amid a segment"):
        signal.pause()
