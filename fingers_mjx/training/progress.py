"""Progress of a run as it happens: a live table on a terminal, else lines of JSON.

A run reports events, dicts with the key "event":

    compiling    elapsed_s
    progress     one row of metrics (see `fingers_mjx.training.row`)
    checkpoint   path, iteration
    note         text, one sentence
"""

import json
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TextIO

from rich.console import Console
from rich.live import Live

from fingers_mjx.training.progress_table import Board

Event = Mapping[str, Any]
OnProgress = Callable[[Event], None]

QUIET_S = 10.0
"""Time between two lines that say "compiling" where they are kept [s]."""


@contextmanager
def reporter(stream: TextIO) -> Iterator[OnProgress]:
    """Yields what shows events on `stream`: live on a terminal, else JSON lines."""
    if not stream.isatty():
        yield _json_lines(stream)
        return
    board = Board()
    console = Console(file=stream)
    with Live(board.render(), console=console, refresh_per_second=4) as live:

        def show(event: Event) -> None:
            if sentence := board.take(event):
                console.print(sentence)
            live.update(board.render())

        yield show


def _json_lines(stream: TextIO) -> OnProgress:
    """Returns what prints each event as a line; compilation only every 10 s."""
    due_s = 0.0

    def show(event: Event) -> None:
        nonlocal due_s
        if event["event"] == "compiling":
            if event["elapsed_s"] < due_s:
                return
            due_s = event["elapsed_s"] + QUIET_S
        print(json.dumps(event), file=stream, flush=True)

    return show


class Ticker:
    """Reports "compiling" with the time elapsed, until it is stopped.

    Args:
        on_progress: called with the events, from a thread of its own.
        period_s: time between two events [s].
    """

    def __init__(self, on_progress: OnProgress, period_s: float):
        self._on_progress, self._period_s = on_progress, period_s
        self._started_s = time.monotonic()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._tick, daemon=True)

    def __enter__(self) -> "Ticker":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Ends the reports; more than once does no harm."""
        self._over.set()
        self._thread.join()

    def _tick(self) -> None:
        """Reports at once and then in every period."""
        elapsed_s = 0.0
        while True:
            event = {"event": "compiling", "elapsed_s": round(elapsed_s, 1)}
            self._on_progress(event)
            if self._over.wait(self._period_s):
                return
            elapsed_s = time.monotonic() - self._started_s
