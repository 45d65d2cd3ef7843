"""Watchdog: a run that makes no progress is ended, and says where it hung."""

import faulthandler
import os
import statistics
import sys
import threading
import time
from pathlib import Path

EXIT_CODE = 75
FIRST_LIMIT_S = 3600.0
"""Time that compilation and the first iteration may take (ours)."""


class Watchdog:
    """Ends the process if `beat` is not called for too long.

    Too long is ten times the median time between beats, and at least `limit_s`. The
    stacks of all threads go to `report` and to stderr; the exit status is that of an
    interrupted run, which can be resumed from its newest checkpoint.

    Args:
        report: file for the stacks.
        limit_s: shortest silence that counts as a hang [s].
        first_limit_s: the same before the first beat [s].
    """

    def __init__(
        self, report: Path, limit_s: float, first_limit_s: float = FIRST_LIMIT_S
    ):
        self._report, self._limit_s = report, limit_s
        self._first_limit_s = max(first_limit_s, limit_s)
        self._times_s: list[float] = []
        self._last_s = time.monotonic()
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> "Watchdog":
        self._last_s = time.monotonic()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._thread.join()

    def beat(self) -> None:
        """Marks that the run advances."""
        now_s = time.monotonic()
        self._times_s = [*self._times_s[-99:], now_s - self._last_s]
        self._last_s = now_s

    @property
    def limit_s(self) -> float:
        """Silence that counts as a hang at present [s]."""
        if not self._times_s:
            return self._first_limit_s
        return max(self._limit_s, 10.0 * statistics.median(self._times_s))

    def _watch(self) -> None:
        """Looks at the time of the last beat until the run is over."""
        period_s = min(1.0, self._limit_s / 4.0)
        while not self._done.wait(period_s):
            silence_s = time.monotonic() - self._last_s
            if silence_s > self.limit_s:
                self._end(silence_s)

    def _end(self, silence_s: float) -> None:
        """Writes where every thread is and ends the process."""
        print(
            f"no progress for {silence_s:.0f} s; stacks in {self._report}",
            file=sys.stderr,
            flush=True,
        )
        with self._report.open("w", encoding="utf-8") as file:
            faulthandler.dump_traceback(file, all_threads=True)
        faulthandler.dump_traceback(sys.stderr, all_threads=True)
        os._exit(EXIT_CODE)
