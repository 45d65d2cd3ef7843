"""Messages between the guard and the two processes that it watches."""

import contextlib
import math
import socket
from collections.abc import Iterator

BEAT_S = 0.1
"""How often a watched process shows that it is there."""
SILENCE_S = 1.0
"""A watched process that shows nothing for so long [s] is gone."""
ALIVE, FAREWELL, READY, TAKEN = b"alive", b"farewell", b"ready", b"taken"
_LONGEST, _AT_ONCE = 4096, 16


class WatchedEnd:
    """The end of a process that the guard watches; never blocks.

    Args:
        end: the socket.
    """

    def __init__(self, end: socket.socket):
        self._socket = end
        end.setblocking(False)
        self._beat_s = -math.inf
        self.ready = False
        """The guard has begun to watch."""
        self.there = True
        """The guard's process has its end open."""
        self.report = ""
        """What came of its work, once it had some."""

    def beat(self, t: float, pid: int = 0) -> None:
        """Shows that this process is there, and which it is, if it is time to."""
        if t - self._beat_s >= BEAT_S:
            self._beat_s = t
            self._send(ALIVE + b" %d" % pid)

    def farewell(self) -> None:
        """Says that the hand is off, or was never on: the guard may end."""
        self._send(FAREWELL)

    def poll(self) -> None:
        """Takes what the guard says."""
        for data in _packets(self._socket):
            if not data:
                self.there = False
            elif data == READY:
                self.ready = True
            else:
                self.report = data.decode("utf-8", "replace")
                self._send(TAKEN)

    def _send(self, data: bytes) -> None:
        with contextlib.suppress(OSError):
            self._socket.send(data)


class Watched:
    """The guard's view of one process.

    Args:
        end: the socket; the other end is a `WatchedEnd`.
    """

    def __init__(self, end: socket.socket):
        self.socket = end
        end.setblocking(False)
        self.gone = self.farewell = self.taken = False
        self.pid = 0
        self._last_s = math.inf  # silence counts from the first beat on
        self._send(READY)

    def poll(self, t: float) -> None:
        """Takes what the process says; `t` is monotonic time [s]."""
        for data in _packets(self.socket):
            self.gone = self.gone or not data
            self.farewell = self.farewell or data == FAREWELL
            self.taken = self.taken or data == TAKEN
            name, _, number = data.partition(b" ")
            if name == ALIVE:
                self._last_s, self.pid = t, int(number)

    @property
    def begun(self) -> bool:
        """Whether it has ever shown that it is there."""
        return self._last_s < math.inf

    def silent(self, t: float) -> bool:
        """Whether it was there and shows nothing any more."""
        return t - self._last_s > SILENCE_S

    def report(self, words: str) -> None:
        """Says what came of the guard's work."""
        self._send(words.encode("utf-8", "replace"))

    def _send(self, data: bytes) -> None:
        # One that has gone may have left its farewell: only reading finds that out.
        with contextlib.suppress(OSError):
            self.socket.send(data)


def _packets(end: socket.socket) -> Iterator[bytes]:
    """Yields the packets that wait, and b"" once the other end is gone.

    An end that is closed before it has read everything resets the connection; what it
    had sent, perhaps its farewell, is still there behind that error.
    """
    for _ in range(_AT_ONCE):
        try:
            data = end.recv(_LONGEST)
        except BlockingIOError:
            return
        except ConnectionResetError:
            continue
        except OSError:
            data = b""
        yield data
        if not data:
            return
