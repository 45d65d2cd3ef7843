"""Learning curve on disk: one JSON line per row; loggers take the same rows."""

import json
import math
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from envs.errors import InputError
from fingers_deploy.errors import shortened
from fingers_deploy.files import open_regular, read_regular
from fingers_mjx.runs.files import room_for, write_whole
from fingers_mjx.runs.loggers.base import STEP, TIME, Kept, Logger, Open, Row
from fingers_mjx.runs.loggers.tensorboard import TensorBoard
from fingers_mjx.runs.videos import video_files

_TAIL_BYTES = 1 << 16
MAX_BYTES = 1 << 28


class MetricsLog:
    """Appends rows to `metrics.jsonl`, and gives them to the loggers.

    Opened after a restart, it drops the rows later than the iteration that was
    restored (and a line cut short by a kill), and the loggers begin with the rows kept,
    so that the curve goes on without a seam.

    Args:
        directory: of the run.
        iteration: iterations done when the log is opened.
        loggers: what opens them; TensorBoard's events if not given.
    """

    def __init__(
        self, directory: Path, iteration: int, loggers: Sequence[Open] = (TensorBoard,)
    ):
        self._path = directory / "metrics.jsonl"
        rows = [r for r in read_metrics(self._path) if r[STEP] <= iteration]
        write_whole(self._path, "".join(map(_line, rows)).encode())
        videos = {k: v for k, v in video_files(directory).items() if k <= iteration}
        kept = Kept(directory, rows, videos)
        self._loggers: list[Logger] = []
        with ExitStack() as opened:
            for begin in loggers:
                self._loggers.append(begin(kept))
                opened.callback(self._loggers[-1].close)
            self._closing = opened.pop_all()

    def append(self, row: Row) -> None:
        """Adds one row; it needs "iteration" and "time_s" (seconds since 1970).

        Raises:
            OutOfSpace: if the disk is full.
        """
        line = _line(row)
        with room_for(self._path, len(line)):
            with self._path.open("a", encoding="utf-8") as file:
                file.write(line)
            for logger in self._loggers:
                logger.append(row)

    def append_video(self, iteration: int, path: Path) -> None:
        """Adds a video of the policy.

        Args:
            iteration: of the policy.
            path: of a GIF.

        Raises:
            OutOfSpace: if the disk is full.
        """
        with room_for(self._path, path.stat().st_size):
            for logger in self._loggers:
                logger.append_video(iteration, path)

    def __enter__(self) -> "MetricsLog":
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.close()


def read_metrics(path: Path) -> list[dict[str, Any]]:
    """Returns the rows of a `metrics.jsonl`, up to the first line that is cut short.

    Raises:
        InputError: no regular file, or a line that is no row.
    """
    rows: list[dict[str, Any]] = []
    if not path.exists():
        return rows
    text = read_regular(path, MAX_BYTES).decode(errors="replace")
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            value = json.loads(line)
        except (ValueError, RecursionError):
            break
        row = _row(value)
        if row is None or type(row.get(TIME)) not in (int, float):
            found = shortened(line)
            raise InputError(path, f"line {number}", found, "a row that training wrote")
        rows.append(row)
    return rows


def last_row(path: Path) -> dict[str, Any]:
    """Returns the last whole row of a `metrics.jsonl`, empty if there is none.

    Only the end of the file is read.

    Raises:
        InputError: no regular file.
    """
    if not path.exists():
        return {}
    with open_regular(path, MAX_BYTES) as file:
        file.seek(max(0, path.stat().st_size - _TAIL_BYTES))
        lines = file.read(_TAIL_BYTES).decode(errors="replace").splitlines()
    for line in reversed(lines):
        with suppress(ValueError, RecursionError):
            if (row := _row(json.loads(line))) is not None:
                return row
    return {}


def _row(value: Any) -> dict[str, Any] | None:
    """Returns what a line holds if it is a row: flat, with its iteration."""
    if not (isinstance(value, dict) and type(value.get(STEP)) is int):
        return None
    flat = all(x is None or isinstance(x, int | float | str) for x in value.values())
    return value if flat else None


def _line(row: Row) -> str:
    """Returns `row` as one line of JSON; numbers that are not finite become null."""
    return json.dumps({k: _number(v) for k, v in row.items()}) + "\n"


def _number(value: Any) -> Any:
    """Returns `value`, or None for a float that JSON cannot hold."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
