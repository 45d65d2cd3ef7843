"""The guard's process: starts first, ends last, is there to de-energize alone.

It watches the supervisor and the console, at the highest priority of the run. One
process at a time can open a hand, so that it holds not the hand but all that it needs
to open it. When the supervisor has gone without a farewell, or is silent and has been
killed for it, the guard opens the hand, de-energizes it and waits for the hand to
confirm that, whether or not a console is left. Where systemd has started the run, it
counts on the guard's notices, which come as long as all three are there.
"""

import contextlib
import json
import os
import select
import signal
import socket
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from fingers_deploy.bundle import load_bundle
from fingers_deploy.errors import InputError
from fingers_deploy.manifest import Interface
from fingers_robot.drivers.open import prepare_driver
from fingers_robot.runtime.guard import guard_hand
from fingers_robot.runtime.guard_link import BEAT_S, Watched
from fingers_robot.runtime.realtime import PRIORITY, prefer_this_process
from fingers_robot.runtime.signals import ignore_interrupts
from fingers_robot.runtime.systemd import notify

TRY_S = 5.0  # for so long it tries to open the hand again
_PAUSE_S = 0.05
_TAKEN_S = 0.5


class Guard:
    """Watches a run until it is over.

    Args:
        supervisor: link to the supervisor's process.
        console: link to the console's.
        make_safe: de-energizes the hand; whether it confirmed that, and that in words.
    """

    def __init__(
        self,
        supervisor: socket.socket,
        console: socket.socket,
        make_safe: Callable[[], tuple[bool, str]],
    ):
        self._supervisor, self._console = Watched(supervisor), Watched(console)
        self._make_safe = make_safe
        self._notify = os.environ.get("NOTIFY_SOCKET", "")

    def run(self) -> int:
        """Returns 0 where nothing was left to do or the hand confirmed, else 5."""
        self._watch()
        if self._supervisor.farewell:
            return 0
        safe, words = self._try()
        self._say(f"guard: {words}")
        return 0 if safe else 5

    def _watch(self) -> None:
        """Returns once the supervisor has gone, by itself or killed for its silence."""
        notified_s = time.monotonic()
        while not self._supervisor.gone:
            ends = [e.socket for e in (self._supervisor, self._console) if not e.gone]
            select.select(ends, [], [], _PAUSE_S)
            now = time.monotonic()
            for process in (self._supervisor, self._console):
                process.poll(now)
            if self._supervisor.silent(now) and not self._supervisor.farewell:
                with contextlib.suppress(OSError):
                    os.kill(self._supervisor.pid, signal.SIGKILL)
                return
            if now - notified_s >= BEAT_S and self._all_there(now):
                notified_s = now
                notify(self._notify, "READY=1\nWATCHDOG=1")

    def _all_there(self, now: float) -> bool:
        both = self._supervisor, self._console
        return bool(self._notify) and all(
            x.begun and not (x.gone or x.silent(now)) for x in both
        )

    def _try(self) -> tuple[bool, str]:
        """Tries until the hand has confirmed, or for `TRY_S`."""
        deadline = time.monotonic() + TRY_S
        while not (done := self._make_safe())[0] and time.monotonic() < deadline:
            time.sleep(_PAUSE_S)
        return done

    def _say(self, words: str) -> None:
        """Has the console say it; where there is none that does, says it itself."""
        self._console.report(words)
        deadline = time.monotonic() + _TAKEN_S
        while time.monotonic() < deadline and not self._console.gone:
            self._console.poll(time.monotonic())
            if self._console.taken:
                return
            time.sleep(_PAUSE_S)
        with contextlib.suppress(OSError):
            os.write(2, f"{words}\n".encode())


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the process: options as JSON, links to the supervisor and to the console."""
    text, *handles = sys.argv[1:] if arguments is None else arguments
    ignore_interrupts()
    supervisor, console = (socket.socket(fileno=int(handle)) for handle in handles)
    options: Mapping[str, Any] = json.loads(text)
    try:
        interface: Interface = load_bundle(options["bundles"][0]).manifest.interface
        prepare_driver(options["driver"])
    except InputError:
        return 2  # the supervisor says so
    # Before the supervisor in every queue: it may have to be killed.
    prefer_this_process(PRIORITY + 10, ask=bool(options["realtime"]))
    make_safe = lambda: guard_hand(options["driver"], interface)  # noqa: E731
    return Guard(supervisor, console, make_safe).run()


if __name__ == "__main__":
    sys.exit(main())
