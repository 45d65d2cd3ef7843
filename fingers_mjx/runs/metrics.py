"""Learning curve on disk: one JSON line per row, and the same as TensorBoard events."""

import json
import math
import struct
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from tensorboardX.proto.event_pb2 import Event  # pyright: ignore
from tensorboardX.proto.summary_pb2 import Summary  # pyright: ignore
from tensorboardX.record_writer import RecordWriter

from envs.errors import InputError
from fingers_deploy.errors import shortened
from fingers_deploy.files import open_regular, read_regular
from fingers_mjx.runs.files import room_for, write_whole
from fingers_mjx.runs.videos import video_files

Row = Mapping[str, Any]
_STEP, _TIME = "iteration", "time_s"
_TAIL_BYTES = 1 << 16
MAX_BYTES = 1 << 28


class MetricsLog:
    """Appends rows to `metrics.jsonl` and to a TensorBoard event file beside it.

    Opened after a restart, it drops the rows later than the iteration that was
    restored (and a line cut short by a kill), and writes the event file anew from the
    rows kept, so that the curve goes on without a seam.

    Args:
        directory: of the run.
        iteration: iterations done when the log is opened.
    """

    def __init__(self, directory: Path, iteration: int):
        self._path = directory / "metrics.jsonl"
        rows = [r for r in read_metrics(self._path) if r[_STEP] <= iteration]
        write_whole(self._path, "".join(map(_line, rows)).encode())
        events = directory / "events.out.tfevents.0"
        with room_for(events, 0):
            self._events = RecordWriter(str(events))
            events.chmod(0o644)
            self._write_event(Event(wall_time=0.0, file_version="brain.Event:2"))
            for row in rows:
                self._write_event(_event(row))
            for at, path in video_files(directory).items():
                if at <= iteration:
                    self._write_event(_video_event(at, path))
            self._events.flush()

    def append(self, row: Row) -> None:
        """Adds one row; it needs "iteration" and "time_s" (seconds since 1970).

        Raises:
            OutOfSpace: if the disk is full.
        """
        line = _line(row)
        with room_for(self._path, len(line)):
            with self._path.open("a", encoding="utf-8") as file:
                file.write(line)
            self._write_event(_event(row))
            self._events.flush()

    def append_video(self, iteration: int, path: Path) -> None:
        """Adds a video of the policy, which TensorBoard shows among the images.

        Args:
            iteration: of the policy.
            path: of a GIF.

        Raises:
            OutOfSpace: if the disk is full.
        """
        with room_for(self._path, path.stat().st_size):
            self._write_event(_video_event(iteration, path))
            self._events.flush()

    def __enter__(self) -> "MetricsLog":
        return self

    def __exit__(self, *_: object) -> None:
        self._events.close()

    def _write_event(self, event: Event) -> None:
        """Appends one event."""
        self._events.write(event.SerializeToString())


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
        if row is None or type(row.get(_TIME)) not in (int, float):
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
    if not (isinstance(value, dict) and type(value.get(_STEP)) is int):
        return None
    flat = all(x is None or isinstance(x, int | float | str) for x in value.values())
    return value if flat else None


def _line(row: Row) -> str:
    """Returns `row` as one line of JSON; numbers that are not finite become null."""
    return json.dumps({k: _number(v) for k, v in row.items()}) + "\n"


def _number(value: Any) -> Any:
    """Returns `value`, or None for a float that JSON cannot hold."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _event(row: Row) -> Event:
    """Returns the numbers of `row` as one TensorBoard event."""
    numbers = {k: v for k, v in row.items() if isinstance(v, int | float)}
    values = [
        Summary.Value(tag=name, simple_value=float(value))
        for name, value in numbers.items()
        if name not in (_STEP, _TIME)
    ]
    summary = Summary(value=values)
    return Event(wall_time=row[_TIME], step=row[_STEP], summary=summary)


def _video_event(iteration: int, path: Path) -> Event:
    """Returns a GIF as one TensorBoard event; its size stands in its first bytes."""
    content = read_regular(path, MAX_BYTES)
    width, height = struct.unpack("<HH", content[6:10])
    image = Summary.Image(
        height=height, width=width, colorspace=3, encoded_image_string=content
    )
    summary = Summary(value=[Summary.Value(tag="policy", image=image)])
    return Event(wall_time=path.stat().st_mtime, step=iteration, summary=summary)
