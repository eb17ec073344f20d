"""Ending a long run on purpose between two of its segments: when its time is up, or when a signal asks for it."""

import math
import signal
import time

import psutil

from slurrycast.runtime.files import Unfinished

GRACE_S = 20  # schedulers kill 30 s after SIGTERM, as a rule
RESERVE_S = 60.0  # of a budget, at most half of it: for the start of the job and to gather the outputs
MARGIN = 1.2  # by so much the next segment may take longer than the one before


class Stop:
    """Tells whether another segment may begin, and whether the running one may go on.

    `budget_s` counts from the start of this process; 0 is no limit. SIGUSR1 lets the running segment end. So does
    SIGTERM if it should take at most GRACE_S; if not, or if it does take longer, the segment is given up.
    """

    def __init__(self, name: str, budget_s: float) -> None:
        self._name, self._budget_s = name, budget_s
        self._usable_s = max(budget_s - RESERVE_S, budget_s / 2)
        self.asked: str | None = None  # name of the signal
        self._from = self._to = 0
        self._began_s = self._per_step_s = math.nan
        self._began_any = False
        signal.signal(signal.SIGUSR1, self._on_signal)
        signal.signal(signal.SIGTERM, self._on_signal)
        signal.signal(signal.SIGALRM, self._give_up)

    def begin(self, first: int, last: int) -> None:
        """Raise Unfinished unless the segment between two steps may begin.

        The first one of an attempt begins whatever the budget, or no attempt would ever get any further.
        """
        if self.asked:
            raise Unfinished(f"[{self._name}] stopped at step {first} by {self.asked}: the same command goes on")
        elapsed_s = time.time() - psutil.Process().create_time()
        needed_s = MARGIN * (last - first) * self._per_step_s
        if self._began_any and self._budget_s and elapsed_s + needed_s > self._usable_s:
            raise Unfinished(
                f"[{self._name}] stopped at step {first}: the next segment takes about {needed_s:.0f} s, and "
                f"{elapsed_s:.0f} of {self._budget_s:.0f} s are gone: the same command goes on"
            )
        self._from, self._to, self._began_s, self._began_any = first, last, time.monotonic(), True

    def reached(self, step: int) -> None:
        """Note how far the running segment is."""
        if step > self._from:
            self._per_step_s = (time.monotonic() - self._began_s) / (step - self._from)

    def _left_s(self) -> float:
        return (self._to - self._from) * self._per_step_s - (time.monotonic() - self._began_s)

    def _on_signal(self, number: int, _) -> None:
        self.asked = signal.Signals(number).name
        if number == signal.SIGTERM:
            if not self._left_s() <= GRACE_S:  # not known counts as long
                self._give_up()
            signal.alarm(GRACE_S)

    def _give_up(self, *_) -> None:
        raise Unfinished(f"[{self._name}] stopped by {self.asked} amid a segment: the same command goes on")
