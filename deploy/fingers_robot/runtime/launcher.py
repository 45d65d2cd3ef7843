"""The console's end of a run: starts the other processes and watches over them.

It holds neither driver nor policy. The guard is started first and ends last. When the
supervisor's process dies or falls silent, it is killed, and the guard opens the hand
once more to de-energize it; where the guard has gone as well, this process does that.
"""

import contextlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

from fingers_deploy.bundle import load_bundle
from fingers_robot.runtime.console import ALIVE, ALIVE_S
from fingers_robot.runtime.guard import guard_hand
from fingers_robot.runtime.guard_link import WatchedEnd
from fingers_robot.runtime.link import make_link
from fingers_robot.runtime.systemd import notify
from fingers_robot.waiting import waiting

SILENCE_S = 1.0
START_S = 30.0
FINISH_S = 6.0  # settling, and the hand's confirmation
GUARD_S = 9.0  # what the guard takes at most
LAST_S = 20.0  # all that, and the end of the policy's process
EXIT_CRASH, EXIT_TRIP, EXIT_PREFLIGHT, EXIT_UNKNOWN = 1, 5, 6, 7
_DONE = (0, 2)  # of the guard: nothing to do or done, and input that all refuse
UNKNOWN = (
    "THE STATE OF THE HAND IS UNKNOWN: it has not confirmed that it is off. "
    "CUT THE BATTERY"
)


class Launcher:
    """One run.

    Args:
        options: for all processes, see `supervisor_process` and `policy_process`.
        say: takes lines for the operator; never waits.
    """

    def __init__(self, options: Mapping[str, Any], say: Callable[[str], None]):
        self._options, self._say = options, say
        # Read now: when the guard needs it, the file may be gone.
        self._interface = load_bundle(options["bundles"][0]).manifest.interface
        self.status: dict[str, Any] = {}
        supervisor, policy = make_link()
        self._console, console = make_link()
        self._console.setblocking(False)
        supervised, by_guard = make_link()
        mine, with_console = make_link()
        self._guard_end = WatchedEnd(mine)
        text = json.dumps(options)
        self.guard = _start("guard_process", text, by_guard, with_console)
        self.policy = _start("policy_process", text, policy)
        ends = supervisor, console, supervised
        self.supervisor = _start("supervisor_process", text, *ends)
        self._status_s = time.monotonic() + START_S
        self._alive_s = 0.0
        self._late = self._unguarded = False
        self._notify = os.environ.get("NOTIFY_SOCKET", "")

    def send(self, word: str) -> None:
        """Sends an action of the operator: arm, stop, off, clear, quit, policy N."""
        try:
            self._console.send(word.encode("ascii", "replace"))
        except BlockingIOError:
            return  # as much waits as the supervisor will ever take
        except OSError:
            self._say("the supervisor does not take actions")

    def poll(self, wait_s: float) -> bool:
        """Takes the statuses that come; returns whether the supervisor still runs."""
        select.select([self._console], [], [], wait_s)
        for data in waiting(self._console.recv, 65536):
            if not data:
                return False
            self._take(json.loads(data))
        self._show(time.monotonic())
        if time.monotonic() - self._status_s > SILENCE_S:
            self._say("the supervisor is silent: killed")
            self.supervisor.kill()
            return False
        return self.supervisor.poll() is None

    def finish(self) -> int:
        """Waits for the end of all processes; returns the exit status of the run.

        Where the supervisor did not end by itself, the guard de-energizes the hand.
        """
        self._console.close()
        if self._notify:
            # Longer than everything that follows; nobody beats any more.
            notify(self._notify, f"WATCHDOG_USEC={round(1e6 * LAST_S)}\nWATCHDOG=1")
        status = _wait(self.supervisor, FINISH_S)
        if status < 0 or status == EXIT_CRASH:
            why = signal.Signals(-status).name if status < 0 else "an error of its own"
            self._say(f"the supervisor died ({why})")
            status = EXIT_TRIP if self._guarded() else EXIT_UNKNOWN
        elif status == EXIT_TRIP and not self.status.get("over"):
            status = EXIT_TRIP if self._guarded() else EXIT_UNKNOWN
        _wait(self.guard, GUARD_S)
        policy = _wait(self.policy, SILENCE_S)
        if status == EXIT_UNKNOWN:
            self._say(UNKNOWN)
        return policy if status == 0 and policy == 2 else status

    def _show(self, now: float) -> None:
        """Shows the others that this process is there, and takes the guard's report."""
        if now - self._alive_s >= ALIVE_S:
            self._alive_s = now
            with contextlib.suppress(OSError):
                self._console.send(ALIVE.encode("ascii"))
        self._guard_end.beat(now)
        self._guard_end.poll()
        lost = self.guard.poll() not in (None, *_DONE) and not self._guard_end.report
        if lost and not self._unguarded and self.supervisor.poll() is None:
            self._unguarded = True
            self._say("the guard died: no run goes on without it")
            self.send("quit")

    def _guarded(self) -> bool:
        """Waits for the guard's work, or does it; whether the hand has confirmed."""
        deadline = time.monotonic() + GUARD_S
        end = self._guard_end
        while end.there and not end.report and time.monotonic() < deadline:
            end.poll()
            time.sleep(0.005)
        if end.report:
            self._say(end.report)
            return _wait(self.guard, GUARD_S) == 0
        if not end.there and _wait(self.guard, SILENCE_S) == 0:
            return True  # nothing was left to do
        self.guard.kill()  # it has gone, or is stopped: two may not open the hand
        safe, words = guard_hand(self._options["driver"], self._interface)
        self._say(f"guard: {words}")
        return safe

    def _take(self, status: dict[str, Any]) -> None:
        before, self.status = self.status, status
        self._status_s = time.monotonic()
        for line in status["events"]:
            self._say(line)
        if status["recording_error"] and not before.get("recording_error"):
            self._say(f"NOT RECORDING: {status['recording_error']}; the run goes on")
        if status["timing_warning"] and not self._late:
            self._say(
                "NOT ON TIME: more than 1 % of the control steps of the last 10 s were "
                f"skipped or late by 5 ms; {status['realtime']}"
            )
        self._late = status["timing_warning"]
        if status["alarm"]:
            self._say("CUT THE BATTERY: the hand does not confirm that it is off")


def _start(module: str, text: str, *ends: socket.socket) -> subprocess.Popen:
    """Starts a process of this package that owns these sockets."""
    handles = [str(end.fileno()) for end in ends]
    program = [sys.executable, "-m", f"fingers_robot.runtime.{module}", text]
    process = subprocess.Popen(
        [*program, *handles], pass_fds=[e.fileno() for e in ends]
    )
    for end in ends:
        end.close()
    return process


def _wait(process: subprocess.Popen, seconds: float) -> int:
    """Waits for the end of a process, kills it after some time; its exit status."""
    try:
        return process.wait(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()
