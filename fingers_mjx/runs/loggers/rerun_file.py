"""The curve as a Rerun recording, in one file that is written anew on every opening."""

from pathlib import Path
from typing import Any

import numpy as np

from fingers_mjx.runs.loggers.base import STEP, TIME, About, Kept, Row, numbers

RERUN_FILE = "metrics.rrd"
APPLICATION = "fingers_mjx"
BATCH_S = 30.0
"""How long rows are gathered: one at a time, they would take ten times the space."""


class RerunFile:
    """Appends rows and videos to the recording of a run.

    Args:
        about: the run.
        kept: what the run has so far.

    Raises:
        ModuleNotFoundError: the extra `rerun` is missing.
    """

    def __init__(self, about: About, kept: Kept):
        import rerun  # pyright: ignore[reportMissingImports]

        self._rerun: Any = rerun
        batches = rerun.ChunkBatcherConfig(flush_tick=BATCH_S)
        self._stream = rerun.RecordingStream(APPLICATION, batcher_config=batches)
        self._stream.save(kept.directory / RERUN_FILE)
        self._stream.send_recording_name(
            "/".join(filter(None, (about.group, about.name)))
        )
        for row in kept.rows:
            self.append(row)
        for at, path in kept.videos.items():
            self.append_video(at, path)

    def append(self, row: Row) -> None:
        """Adds one row, at its iteration and at its time."""
        self._stream.set_time(STEP, sequence=row[STEP])
        self._stream.set_time("time", timestamp=row[TIME])
        for name, value in numbers(row).items():
            self._stream.log(name, self._rerun.Scalars(value))

    def append_video(self, iteration: int, path: Path) -> None:
        """Adds the frames of a video, along a time of their own."""
        from PIL import Image, ImageSequence

        self._stream.reset_time()
        seconds = 0.0
        with Image.open(path) as film:
            for frame in ImageSequence.Iterator(film):
                self._stream.set_time("film", duration=seconds)
                picture = self._rerun.Image(np.asarray(frame.convert("RGB")))
                self._stream.log(f"policy/{iteration:08d}", picture.compress())
                seconds += frame.info.get("duration", 0) / 1000
        self._stream.reset_time()

    def close(self) -> None:
        """Writes what is left and closes the file."""
        self._stream.flush()
        self._stream.disconnect()
