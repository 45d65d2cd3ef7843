"""Reading what is typed, in a thread of its own: nothing holds up a stop.

Stop, off and quit leave from the thread at once and drop what was typed before them. Of
everything else the newest line of each kind waits for the console's loop (keys add up),
which takes each kind only so often. So a flood costs neither memory nor time.
"""

import os
import select
import threading
import time
from collections.abc import Callable

from fingers_robot.cli.words import MAX_KEYS, URGENT, Word, parse

_CHUNK = 65536
_LONGEST = 4096  # bytes of a line; the rest of a longer one is not kept
_AT_ONCE = 1000  # lines of one chunk; of more only the last
_FLOOD_S = 0.005  # pause after a full chunk, so that a flood leaves the processor free
SPACING_S = 0.25
_URGENT = {word.encode("ascii") for word in URGENT}


class Typed:
    """Lines of an operator.

    Args:
        policies: how many policies the run has.
        send: takes words for the supervisor, from either thread.
        holds: whether it holds the heading.
    """

    def __init__(self, policies: int, send: Callable[[str], None], holds: bool = False):
        self._policies, self._send, self._holds = policies, send, holds
        self.closed = False
        """Nothing more can be typed."""
        self.stopped = False
        """A stop was typed: nothing is armed any more without being asked to."""
        self._lock = threading.Lock()
        self._rest = b""
        self._pending: dict[str, Word] = {}
        self._sent_s: dict[str, float] = {}
        self._refused, self._refusal = 0, ""

    def follow(self, handle: int) -> None:
        """Starts the thread that reads a file descriptor until it is closed."""
        arguments = (handle,)
        threading.Thread(target=self._run, args=arguments, daemon=True).start()

    def feed(self, data: bytes) -> None:
        """Takes bytes as they come; the rest of the last line waits for its end."""
        *lines, rest = (self._rest + data).split(b"\n")
        self._rest = rest[:_LONGEST]
        urgent = [i for i, line in enumerate(lines) if line.strip() in _URGENT]
        if urgent:
            with self._lock:
                self.stopped = True
                self._pending.clear()
                for word in dict.fromkeys(lines[i].strip() for i in urgent):
                    self._send(word.decode("ascii"))
            lines = lines[urgent[-1] + 1 :]
        for line in lines[-_AT_ONCE:]:
            if line.strip():
                self._take(line)

    def pass_on(self, now: float) -> tuple[str, ...]:
        """Sends what waits, of each kind one in `SPACING_S`; returns the kinds.

        Under the lock: what was typed before a stop is never sent after it.
        """
        with self._lock:
            ready = [
                word
                for kind, word in self._pending.items()
                if now - self._sent_s.get(kind, -SPACING_S) >= SPACING_S
            ]
            for word in ready:
                del self._pending[word.kind]
                self._sent_s[word.kind] = now
                for text in word.sends:
                    self._send(text)
        return tuple(word.kind for word in ready)

    def arm(self) -> None:
        """Sends arm for an operator who asked for it beforehand and has not stopped."""
        with self._lock:
            if not self.stopped:
                self._send("arm")

    def refusal(self) -> str:
        """Returns one sentence on the lines that were refused since the last call."""
        with self._lock:
            count, self._refused = self._refused, 0
            more = f" (and {count - 1} before it)" if count > 1 else ""
            return f"{self._refusal}{more}" if count else ""

    def _take(self, line: bytes) -> None:
        word = parse(line[:_LONGEST], self._policies, self._holds)
        with self._lock:
            if isinstance(word, str):
                self._refused, self._refusal = self._refused + 1, word
                return
            before = self._pending.pop(word.kind, None)
            if word.kind == "keys" and before is not None:
                word = Word("keys", (*before.sends, *word.sends)[:MAX_KEYS])
            self._pending[word.kind] = word

    def _run(self, handle: int) -> None:
        waiting = select.poll()
        waiting.register(handle, select.POLLIN)
        while not self.closed:
            waiting.poll()
            try:
                data = os.read(handle, _CHUNK)
            except BlockingIOError:
                continue
            except OSError:
                data = b""
            if not data:
                self.closed = True
                return
            self.feed(data)
            if len(data) == _CHUNK:
                time.sleep(_FLOOD_S)
