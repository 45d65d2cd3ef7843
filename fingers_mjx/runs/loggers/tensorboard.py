"""The curve as TensorBoard events, in one file that is written anew on every opening.

So a curve that goes on from an earlier iteration has no seam.
"""

import struct
from pathlib import Path

from tensorboardX.proto.event_pb2 import Event  # pyright: ignore
from tensorboardX.proto.summary_pb2 import Summary  # pyright: ignore
from tensorboardX.record_writer import RecordWriter

from fingers_deploy.files import read_regular
from fingers_mjx.runs.files import room_for
from fingers_mjx.runs.loggers.base import STEP, TIME, Kept, Row, numbers

EVENTS_FILE = "events.out.tfevents.0"
MAX_VIDEO_BYTES = 1 << 28


class TensorBoard:
    """Appends rows and videos to the event file of a run.

    Args:
        kept: what the run has so far.

    Raises:
        OutOfSpace: if the disk is full.
    """

    def __init__(self, kept: Kept):
        events = kept.directory / EVENTS_FILE
        with room_for(events, 0):
            self._events = RecordWriter(str(events))
            events.chmod(0o644)
            self._write(Event(wall_time=0.0, file_version="brain.Event:2"))
            for row in kept.rows:
                self._write(_event(row))
            for at, path in kept.videos.items():
                self._write(_video_event(at, path))
            self._events.flush()

    def append(self, row: Row) -> None:
        """Adds one row."""
        self._write(_event(row))
        self._events.flush()

    def append_video(self, iteration: int, path: Path) -> None:
        """Adds a video, which TensorBoard shows among the images."""
        self._write(_video_event(iteration, path))
        self._events.flush()

    def close(self) -> None:
        """Closes the file."""
        self._events.close()

    def _write(self, event: Event) -> None:
        self._events.write(event.SerializeToString())


def _event(row: Row) -> Event:
    """Returns the numbers of `row` as one event."""
    values = [
        Summary.Value(tag=name, simple_value=value)
        for name, value in numbers(row).items()
    ]
    return Event(wall_time=row[TIME], step=row[STEP], summary=Summary(value=values))


def _video_event(iteration: int, path: Path) -> Event:
    """Returns a GIF as one event; its size stands in its first bytes."""
    content = read_regular(path, MAX_VIDEO_BYTES)
    width, height = struct.unpack("<HH", content[6:10])
    image = Summary.Image(
        height=height, width=width, colorspace=3, encoded_image_string=content
    )
    summary = Summary(value=[Summary.Value(tag="policy", image=image)])
    return Event(wall_time=path.stat().st_mtime, step=iteration, summary=summary)
