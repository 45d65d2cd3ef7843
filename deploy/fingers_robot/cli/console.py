"""The operator's console: typed actions in, plain lines out."""

import math
import os
import select
import signal
import sys
import time
from collections.abc import Mapping
from typing import Any

from fingers_robot.behaviour.keys import ARROWS
from fingers_robot.runtime.launcher import EXIT_PREFLIGHT, Launcher

HELP = "type: arm, stop, clear, policy N, keys NAME …, status, quit"
REFUSED = 2  # exit status of a process that refuses its input
_RETRY_S = 0.5
_LONGEST = 4096  # characters of input that are taken at once
_ARM_WITHIN_S = 15.0


def drive(options: Mapping[str, Any], arm: bool, duration_s: float | None) -> int:
    """Runs until the operator quits or the time is over.

    Args:
        options: of `runtime.launcher.Launcher`.
        arm: arm at once, as soon as everything is ready.
        duration_s: as for `Console`.

    Returns:
        The exit status.
    """
    launcher = Launcher(options, say)
    return Console(launcher, arm, duration_s).run()


def say(line: str) -> None:
    """Prints a line; a terminal that is gone must not end the watch over the hand."""
    try:
        print(line, flush=True)
    except OSError:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115


class Console:
    """One session at the console.

    Args:
        launcher: of the run.
        arm: arm as soon as everything is ready.
        duration_s: quit after so long [s], with `arm` counted from when the policy
            begins; None: never.
    """

    def __init__(self, launcher: Launcher, arm: bool, duration_s: float | None):
        self._launcher, self._arm = launcher, arm
        self._start_s = self._asked_s = time.monotonic()
        self._duration_s = duration_s
        self._armed = self._quitting = self._helped = False
        self._input_open, self._rest = True, b""

    def run(self) -> int:
        """Serves the operator until the run is over; returns the exit status."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: self._quit())
        while self._launcher.poll(0.05):
            self._help()
            self._read_input()
            self._step()
        status = self._launcher.finish()
        self._report()
        return (
            EXIT_PREFLIGHT if status == 0 and self._arm and not self._armed else status
        )

    def _help(self) -> None:
        """Says once what may be typed, when there is something to type at."""
        if not (self._arm or self._helped) and self._launcher.status:
            self._helped = True
            say(HELP)

    def _step(self) -> None:
        now, mode = time.monotonic(), self._launcher.status.get("mode")
        if mode == "active" and self._arm and not self._armed:
            self._armed, self._start_s = True, now
        if self._arm and mode == "disabled" and not self._armed:
            if now - self._start_s > _ARM_WITHIN_S:
                self._quit()
            elif now - self._asked_s > _RETRY_S:
                self._asked_s = now
                self._launcher.send("arm")
        counts = self._armed or not self._arm
        if self._launcher.policy.poll() == REFUSED:
            self._quit()
        longest_s = math.inf if self._duration_s is None else self._duration_s
        if counts and now - self._start_s > longest_s:
            self._quit()
        if self._arm and (mode == "safe" or (mode == "stopping" and not self._armed)):
            self._quit()

    def _quit(self) -> None:
        if not self._quitting:
            self._quitting = True
            self._launcher.send("quit")

    def _read_input(self) -> None:
        """Takes whole lines, without ever waiting for the rest of one."""
        if not self._input_open or not select.select([sys.stdin], [], [], 0)[0]:
            return
        data = os.read(sys.stdin.fileno(), _LONGEST)
        if not data:
            self._input_open = False
            if sys.stdin.isatty():
                self._quit()
            return
        *lines, self._rest = (self._rest + data).split(b"\n")
        self._rest = self._rest[-_LONGEST:]
        for line in lines:
            self._act(" ".join(line.decode("utf-8", "replace").split()))

    def _act(self, word: str) -> None:
        if word == "status":
            self._report()
        elif word == "quit":
            self._quit()
        elif word in ("arm", "stop", "clear") or _selects(word):
            self._launcher.send(word)
        elif keys := _keys(word):
            for key in keys:
                self._launcher.send(f"key {key}")
        elif word:
            say(HELP)

    def _report(self) -> None:
        status = self._launcher.status
        if not status:
            return
        say(f"mode {status['mode']}, {status['realtime']}")
        for line in status["faults"]:
            say(f"  fault {line}")
        for name, passed, found in status["checks"]:
            say(f"  {'ok  ' if passed else 'FAIL'} {name}: {found}")
        timing = status["timing"]
        say(
            f"  {timing['control_steps']} control steps, {timing['skipped']} skipped, "
            f"{timing['late_over_5ms']} more than 5 ms late; late "
            f"{timing['late_p50_ms']:.1f} / {timing['late_p999_ms']:.1f} / "
            f"{timing['late_max_ms']:.1f} ms (50 %, 99.9 %, worst)"
        )
        if status["recording_error"]:
            say(f"  NOT RECORDING: {status['recording_error']}")
        elif status["recording"]:
            say(f"  recording {status['recording']}")


def _selects(word: str) -> bool:
    name, _, number = word.partition(" ")
    return name == "policy" and number.isdigit()


def _keys(word: str) -> list[str]:
    """The keys of `keys left up …`; none if that is not what was typed."""
    first, *names = word.split() or [""]
    return names if first == "keys" and all(n in ARROWS for n in names) else []
