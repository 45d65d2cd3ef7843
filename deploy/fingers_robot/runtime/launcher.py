"""The console's process: starts the other two, watches them, and is the guard.

It holds neither driver nor policy. When the supervisor's process dies or falls silent,
it is killed and the hand is opened once more, only to de-energize it.
"""

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
from fingers_robot.runtime.guard import guard_hand
from fingers_robot.runtime.link import make_link
from fingers_robot.waiting import waiting

SILENCE_S = 1.0
START_S = 30.0
FINISH_S = 6.0  # settling, and the hand's confirmation
LAST_S = 20.0  # that, the guard, and the end of the policy's process
EXIT_CRASH, EXIT_TRIP, EXIT_PREFLIGHT = 1, 5, 6


class Launcher:
    """One run.

    Args:
        options: for both processes, see `supervisor_process` and `policy_process`.
        say: takes lines for the operator.
    """

    def __init__(self, options: Mapping[str, Any], say: Callable[[str], None]):
        self._options, self._say = options, say
        # Read now: when the guard needs it, the file may be gone.
        self._interface = load_bundle(options["bundles"][0]).manifest.interface
        self.status: dict[str, Any] = {}
        supervisor, policy = make_link()
        self._console, console = make_link()
        self._console.setblocking(False)
        text = json.dumps(options)
        self.policy = _start("policy_process", text, policy)
        self.supervisor = _start("supervisor_process", text, supervisor, console)
        self._status_s = time.monotonic() + START_S
        self._late = False
        self._notify = os.environ.get("NOTIFY_SOCKET", "")

    def send(self, word: str) -> None:
        """Sends an action of the operator: arm, stop, clear, quit, policy N."""
        try:
            self._console.send(word.encode("ascii", "replace"))
        except OSError:
            self._say("the supervisor does not take actions")

    def poll(self, wait_s: float) -> bool:
        """Takes the statuses that come; returns whether the supervisor still runs."""
        select.select([self._console], [], [], wait_s)
        for data in waiting(self._console.recv, 65536):
            if not data:
                return False
            self._take(json.loads(data))
        if time.monotonic() - self._status_s > SILENCE_S:
            self._say("the supervisor is silent: killed")
            self.supervisor.kill()
            return False
        return self.supervisor.poll() is None

    def finish(self) -> int:
        """Waits for the end of both processes; returns the exit status of the run.

        Where the supervisor did not end by itself, the guard de-energizes the hand.
        """
        self._console.close()
        if self._notify:
            # Longer than everything that follows; no status comes any more.
            notify(self._notify, f"WATCHDOG_USEC={round(1e6 * LAST_S)}\nWATCHDOG=1")
        try:
            status = self.supervisor.wait(timeout=FINISH_S)
        except subprocess.TimeoutExpired:
            self.supervisor.kill()
            status = self.supervisor.wait()
        if status < 0 or status == EXIT_CRASH:
            why = signal.Signals(-status).name if status < 0 else "an error of its own"
            self._say(f"the supervisor died ({why})")
            self._guard()
            status = EXIT_TRIP
        try:
            policy = self.policy.wait(timeout=SILENCE_S)
        except subprocess.TimeoutExpired:
            self.policy.kill()
            policy = self.policy.wait()
        return policy if status == 0 and policy == 2 else status

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
        if self._notify:
            # Ready with the first status: from then on the watchdog counts.
            notify(self._notify, "READY=1\nWATCHDOG=1")

    def _guard(self) -> None:
        _, words = guard_hand(self._options["driver"], self._interface)
        self._say(f"guard: {words}")


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


def notify(path: str, message: str) -> None:
    """Notifies systemd over its socket; does nothing if nobody listens."""
    address = "\0" + path[1:] if path.startswith("@") else path
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        try:
            end.sendto(message.encode("ascii"), address)
        except OSError:
            return
