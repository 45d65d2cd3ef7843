"""What commands print and keep: progress, and the measures of an evaluation.

Progress is one live line on a terminal, else JSON lines.
"""

import json
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from rich.console import Console
from rich.table import Table

from fingers_mjx.evaluation.files import write_summary
from fingers_mjx.training.progress import Event, Ticker

LINE_EVERY_S = 5.0
"""Time between two lines where they are kept [s]."""

WIDTH = 120
"""Room for whole names and numbers; a narrower terminal breaks the lines itself."""

Count = Callable[[int, int], None]


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


def keep_summary(path: Path | None, summary: Mapping[str, Any]) -> None:
    """Writes a summary as JSON, if a path is given."""
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_summary(path, summary)


def print_measures(summary: Mapping[str, Any]) -> None:
    """Prints the measures of a summary with their 95 % intervals and percentiles."""
    title = f"{summary['policy']}: {summary['episodes']} episodes of {summary['task']}"
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    table.add_column("measure")
    for name in ("mean", "95 % interval", "std", "median", "95th %", "n"):
        table.add_column(name, justify="right")
    for name, measure in summary["measures"].items():
        ends = (_text(measure["low"]), _text(measure["high"]))
        interval = "–" if measure["low"] is None else f"{ends[0]} – {ends[1]}"
        spread = (_text(measure[key]) for key in ("std", "median", "p95"))
        table.add_row(
            name, _text(measure["mean"]), interval, *spread, str(measure["n"])
        )
    Console(soft_wrap=True, highlight=False, width=WIDTH).print(table)


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


def _text(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"
