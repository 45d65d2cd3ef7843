"""The operator's console: typed actions in, plain lines out."""

import math
import os
import stat
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

from fingers_deploy.errors import InputError
from fingers_robot.cli.speaker import Speaker
from fingers_robot.cli.typed import Typed
from fingers_robot.cli.words import HELP
from fingers_robot.runtime.launcher import EXIT_PREFLIGHT, Launcher
from fingers_robot.runtime.realtime import PRIORITY, prefer_this_process
from fingers_robot.runtime.signals import on_request_to_end

REFUSED = 2  # exit status of a process that refuses its input
_RETRY_S = 0.5
_ANSWER_S = 1.0  # refused lines are answered at most so often
_ARM_WITHIN_S = 15.0
_STDIN = 0


def drive(
    options: Mapping[str, Any],
    speaker: Speaker,
    arm: bool,
    duration_s: float | None,
    unattended: bool,
) -> int:
    """Runs until the operator quits or the time is over.

    Args:
        options: of `runtime.launcher.Launcher`.
        speaker: what the operator reads.
        arm: arm at once, as soon as everything is ready.
        duration_s: as for `Console`.
        unattended: go on where nobody can type a stop or read what is said.

    Returns:
        The exit status.
    """
    launcher = Launcher(options, speaker)
    holds = bool(options["heading_hold"])
    typed = Typed(len(options["bundles"]), launcher.send, holds)
    console = Console(launcher, typed, speaker, arm, duration_s)
    if not unattended:
        console.attend(lambda: not typed.closed, lambda: speaker.read)
    typed.follow(_STDIN)
    # After the supervisor, before all that is not part of a run: a stop passes here.
    prefer_this_process(PRIORITY - 5, ask=bool(options["realtime"]))
    return console.run()


def check_operator() -> None:
    """Refuses a run at which nobody can type a stop, or nobody can read.

    Raises:
        InputError: standard input is closed or /dev/null, or standard output is closed.
    """
    found, null = os.fstat(_STDIN), os.stat(os.devnull).st_rdev
    nothing = stat.S_ISCHR(found.st_mode) and found.st_rdev == null
    for name, shut in (
        ("standard input", nothing or sys.stdin is None),
        ("standard output", sys.stdout is None),
    ):
        if shut:
            valid = "a terminal or a pipe for the operator, or --unattended"
            raise InputError(name, "", "closed", valid)


class Console:
    """One session at the console.

    Args:
        launcher: of the run.
        typed: what the operator types.
        say: takes lines for the operator.
        arm: arm as soon as everything is ready.
        duration_s: quit after so long [s], with `arm` counted from when the policy
            begins; None: never.
    """

    def __init__(
        self,
        launcher: Launcher,
        typed: Typed,
        say: Callable[[str], None],
        arm: bool,
        duration_s: float | None,
    ):
        self._launcher, self._typed, self._say = launcher, typed, say
        self._arm = arm
        self._start_s = self._asked_s = time.monotonic()
        self._answered_s = -math.inf
        self._duration_s = duration_s
        self._armed = self._quitting = self._helped = False
        self._types: Callable[[], bool] = lambda: True
        self._reads: Callable[[], bool] = lambda: True

    def attend(self, types: Callable[[], bool], reads: Callable[[], bool]) -> None:
        """Quits once nobody can type any more, or nobody reads."""
        self._types, self._reads = types, reads

    def run(self) -> int:
        """Serves the operator until the run is over; returns the exit status."""
        on_request_to_end(self._quit)
        while self._launcher.poll(0.05):
            self._help()
            self.serve(time.monotonic())
            self._step()
        status = self._launcher.finish()
        self._report()
        return (
            EXIT_PREFLIGHT if status == 0 and self._arm and not self._armed else status
        )

    def serve(self, now: float) -> None:
        """Passes on what was typed, answers what was refused, but only so often."""
        if "status" in self._typed.pass_on(now):
            self._report()
        if now - self._answered_s >= _ANSWER_S and (line := self._typed.refusal()):
            self._answered_s = now
            self._say(line)

    def _help(self) -> None:
        """Says once what may be typed, when there is something to type at."""
        if not (self._arm or self._helped) and self._launcher.status:
            self._helped = True
            self._say(HELP)

    def _step(self) -> None:
        now, mode = time.monotonic(), self._launcher.status.get("mode")
        if mode == "active" and self._arm and not self._armed:
            self._armed, self._start_s = True, now
        if self._arm and mode == "disabled" and not self._armed:
            if now - self._start_s > _ARM_WITHIN_S or self._typed.stopped:
                self._quit()
            elif now - self._asked_s > _RETRY_S:
                self._asked_s = now
                self._typed.arm()
        counts = self._armed or not self._arm
        if self._launcher.policy.poll() == REFUSED:
            self._quit()
        longest_s = math.inf if self._duration_s is None else self._duration_s
        if counts and now - self._start_s > longest_s:
            self._quit()
        if self._arm and (mode == "safe" or (mode == "stopping" and not self._armed)):
            self._quit()
        if not self._types():
            self._quit("standard input is closed: nobody can type a stop")
        if not self._reads():
            self._quit("nobody reads standard output")

    def _quit(self, why: str = "") -> None:
        if self._quitting:
            return
        self._quitting = True
        self._launcher.send("quit")
        if why:
            self._say(f"{why}: the run ends; --unattended would let it go on")

    def _report(self) -> None:
        status = self._launcher.status
        if not status:
            return
        self._say(f"mode {status['mode']}, {status['realtime']}")
        for line in status["faults"]:
            self._say(f"  fault {line}")
        for name, passed, found in status["checks"]:
            self._say(f"  {'ok  ' if passed else 'FAIL'} {name}: {found}")
        timing = status["timing"]
        self._say(
            f"  {timing['control_steps']} control steps, {timing['skipped']} skipped, "
            f"{timing['late_over_5ms']} more than 5 ms late; late "
            f"{timing['late_p50_ms']:.1f} / {timing['late_p999_ms']:.1f} / "
            f"{timing['late_max_ms']:.1f} ms (50 %, 99.9 %, worst)"
        )
        if status["recording_error"]:
            self._say(f"  NOT RECORDING: {status['recording_error']}")
        elif status["recording"]:
            self._say(f"  recording {status['recording']}")
