"""When a run ends on purpose: a clock that is set by hand, and signals."""

import os
import signal

import pytest

from slurrycast.runtime import stopping
from slurrycast.runtime.files import Unfinished
from slurrycast.runtime.stopping import Stop


@pytest.fixture
def clock(monkeypatch):
    """Seconds since the process was started; the handlers of the test process come back afterwards."""
    now = [0.0]

    class Process:
        def create_time(self) -> float:
            return 0.0

    monkeypatch.setattr(stopping.time, "time", lambda: now[0])
    monkeypatch.setattr(stopping.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(stopping.psutil, "Process", Process)
    handlers = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGUSR1, signal.SIGALRM)}
    yield now
    signal.alarm(0)
    for number, handler in handlers.items():
        signal.signal(number, handler)


def test_segments_begin_as_long_as_they_fit(clock):
    stop = Stop("6", budget_s=160.0)  # of which 60 s are kept for the start and the end of the job
    clock[0] = 10.0
    for first in (0, 1000, 2000):
        stop.begin(first, first + 1000)
        clock[0] += 20.0
        stop.reached(first + 1000)
    # 70 s gone, the next 1000 steps take 1.2 x 20 s: they fit; after them they do not
    stop.begin(3000, 4000)
    clock[0] += 20.0
    stop.reached(4000)
    with pytest.raises(Unfinished) as error:
        stop.begin(4000, 5000)
    assert str(error.value) == (
        "[6] stopped at step 4000: the next segment takes about 24 s, and 90 of 160 s are gone: "
        "the same command goes on"
    )
    stop.begin(4000, 4100)  # a shorter one fits


def test_first_segment_of_an_attempt_begins_whatever_the_budget(clock):
    stop = Stop("6", budget_s=5.0)
    clock[0] = 10.0
    stop.begin(0, 1000)
    stop.reached(1000)
    with pytest.raises(Unfinished):
        stop.begin(1000, 2000)


def test_no_budget_is_no_limit(clock):
    stop = Stop("6", budget_s=0.0)
    for first in (0, 1000, 2000):
        stop.begin(first, first + 1000)
        clock[0] += 1e6
        stop.reached(first + 1000)


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


def test_half_of_a_short_budget_is_usable(clock):
    stop = Stop("6", budget_s=40.0)
    for first in (0, 1000):
        stop.begin(first, first + 1000)
        clock[0] += 9.0
        stop.reached(first + 1000)
    with pytest.raises(Unfinished):  # 18 s gone, 9 x 1.2 more
        stop.begin(2000, 3000)
