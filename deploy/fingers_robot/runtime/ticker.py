"""Absolute deadlines on the monotonic clock: skip what was missed, never burst."""

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Tick:
    """One deadline that was waited for.

    Attributes:
        number: number of the deadline since the start.
        t_s: time after waiting [s].
        late_s: how long after the deadline that is [s].
        skipped: deadlines since the tick before that were given up.
    """

    number: int
    t_s: float
    late_s: float
    skipped: int


class Ticker:
    """Deadlines start + k·period, k = 1, 2, ….

    `time.sleep` waits for an absolute time of the monotonic clock, so that neither the
    work between two ticks nor a jump of the wall clock moves a deadline.

    Args:
        period_s: time between deadlines [s].
        clock: monotonic time [s].
        sleep: waits for a time [s].
    """

    def __init__(
        self,
        period_s: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ):
        self._period_s, self._clock, self._sleep = period_s, clock, sleep
        self.start_s = clock()
        self._number = 0

    def wait(self) -> Tick:
        """Waits for the next deadline that has not passed by a whole period."""
        now = self._clock()
        behind = int((now - self.start_s) / self._period_s)
        number = max(self._number + 1, behind)
        skipped = number - self._number - 1
        deadline = self.start_s + number * self._period_s
        if now < deadline:
            self._sleep(deadline - now)
            now = self._clock()
        self._number = number
        return Tick(number, now, now - deadline, skipped)
