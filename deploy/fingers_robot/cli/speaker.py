"""Saying lines to the operator: from a thread, so that no reader holds up the run."""

import os
import queue
import select
import threading
import time

_WAITING = 1000  # lines; more are dropped while nobody reads
_RETRY_S = 0.01
BLOCKED_S = 1.0


class Speaker:
    """Standard output, or what stands for it.

    Args:
        handle: file descriptor to write to.
    """

    def __init__(self, handle: int):
        self._handle = handle
        self._lines: queue.Queue[bytes] = queue.Queue(_WAITING)
        self._broken = False
        self._since_s: float | None = None
        threading.Thread(target=self._run, daemon=True).start()

    def __call__(self, line: str) -> None:
        """Says a line; never waits, one for which there is no room is lost."""
        try:
            self._lines.put_nowait(line.encode("utf-8", "replace") + b"\n")
        except queue.Full:
            return

    @property
    def read(self) -> bool:
        """Whether somebody can read: the reader is there and takes what is said."""
        since_s = self._since_s
        if since_s is not None and time.monotonic() - since_s > BLOCKED_S:
            return False
        return not (self._broken or self._hung_up())

    def finish(self) -> None:
        """Waits until everything is said, but not for a reader who does not read."""
        deadline = time.monotonic() + BLOCKED_S
        while self._lines.unfinished_tasks and time.monotonic() < deadline:
            time.sleep(_RETRY_S)

    def _hung_up(self) -> bool:
        reader = select.poll()
        reader.register(self._handle, 0)
        return bool(reader.poll(0))

    def _run(self) -> None:
        while True:
            data = self._lines.get()
            self._since_s = time.monotonic()
            while data and not self._broken:
                data = data[self._write(data) :]
            self._since_s = None
            self._lines.task_done()

    def _write(self, data: bytes) -> int:
        try:
            return os.write(self._handle, data)
        except BlockingIOError:
            time.sleep(_RETRY_S)
        except OSError:
            self._broken = True
        return 0
