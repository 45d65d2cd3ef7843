"""SIGINT and SIGTERM: the first asks the run to stop, the second ends it at once."""

import os
import signal
import threading
from collections.abc import Callable

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopSignals:
    """Watches for signals while in use; `requested` is whether one has come.

    The bytes of Python's wakeup descriptor are read by a thread, so that a signal
    counts at once even while the main thread waits inside compiled code.

    Args:
        say: called with one sentence when the first signal comes.
    """

    def __init__(self, say: Callable[[str], None]):
        self._say = say
        self._stop = threading.Event()

    @property
    def requested(self) -> bool:
        """Whether a signal has asked the run to stop."""
        return self._stop.is_set()

    def __enter__(self) -> "StopSignals":
        self._reader, self._writer = os.pipe()
        os.set_blocking(self._writer, False)
        self._old = {number: signal.getsignal(number) for number in SIGNALS}
        for number in SIGNALS:
            signal.signal(number, lambda *_: None)
        self._old_fd = signal.set_wakeup_fd(self._writer, warn_on_full_buffer=False)
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        signal.set_wakeup_fd(self._old_fd)
        for number, handler in self._old.items():
            signal.signal(number, handler)
        os.close(self._writer)
        self._thread.join()
        os.close(self._reader)

    def _listen(self) -> None:
        """Counts signals until the pipe is closed; the second ends the process."""
        while received := os.read(self._reader, 64):
            for number in received:
                if number not in SIGNALS:
                    continue
                if self._stop.is_set():
                    os._exit(128 + number)
                self._stop.set()
                self._say("stopping after this iteration; once more stops at once")
