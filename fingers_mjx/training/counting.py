"""Progress of what counts or takes its time: one live line, or JSON lines."""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

from fingers_mjx.training.progress import Event, Ticker

LINE_EVERY_S = 5.0
"""Time between two lines where they are kept [s]."""

Count = Callable[[int, int], None]


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Prints what begins, and how long it took."""
    print(what, flush=True)
    start_s = time.monotonic()
    yield
    print(f"done in {time.monotonic() - start_s:.0f} s", flush=True)


@contextmanager
def counting(stream: TextIO, what: str, unit: str) -> Iterator[Count]:
    """Yields a function to call with (done, in all); prints "preparing" until then.

    Args:
        stream: where the lines go.
        what: the activity, such as "evaluating".
        unit: what is counted, such as "steps".
    """
    show = _Line(stream, what, unit)
    try:
        with Ticker(show.preparing, 1.0) as ticker:

            def count(done: int, total: int) -> None:
                ticker.stop()
                show.count(done, total)

            yield count
    finally:
        show.end()


class _Line:
    """What was printed last, and when."""

    def __init__(self, stream: TextIO, what: str, unit: str):
        self._stream, self._what, self._unit = stream, what, unit
        self._live = stream.isatty()
        self._printed_s = -LINE_EVERY_S

    def preparing(self, tick: Event) -> None:
        elapsed_s = tick["elapsed_s"]
        event = {"event": self._what, "preparing_s": elapsed_s}
        self._print(f"{self._what}: preparing… {elapsed_s:.0f} s", event, False)

    def count(self, done: int, total: int) -> None:
        event = {"event": self._what, "done": done, "total": total, "unit": self._unit}
        text = f"{self._what}: {done:,} of {total:,} {self._unit}"
        self._print(text, event, done >= total)

    def end(self) -> None:
        if self._live:
            print(file=self._stream, flush=True)

    def _print(self, text: str, event: Event, last: bool) -> None:
        now_s = time.monotonic()
        if self._live:
            print(f"\r\x1b[K{text}", end="", file=self._stream, flush=True)
        elif last or now_s - self._printed_s >= LINE_EVERY_S:
            self._printed_s = now_s
            print(json.dumps(event), file=self._stream, flush=True)
