"""The supervisor's process: driver, supervisor, recorder; no ONNX Runtime."""

import json
import os
import socket
import sys
import time
from collections.abc import Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any

from fingers_deploy.bundle import Bundle, load_bundle
from fingers_deploy.errors import InputError
from fingers_robot.drivers.open import open_driver
from fingers_robot.drivers.protocol import Driver
from fingers_robot.record.recorder import Recorder
from fingers_robot.runtime.console import ConsoleLink
from fingers_robot.runtime.core import Core
from fingers_robot.runtime.guard_link import WatchedEnd
from fingers_robot.runtime.link import SupervisorEnd
from fingers_robot.runtime.realtime import prefer_this_process, resident_mb
from fingers_robot.runtime.signals import ignore_interrupts
from fingers_robot.runtime.ticker import Ticker
from fingers_robot.safety.limits import Limits, make_limits
from fingers_robot.safety.machine import ENERGIZED
from fingers_robot.safety.types import Operator

STATUS_S = 0.2
# The speed limit of the joints is the hand's own: nothing here depends on it.
_SHARED = (
    "joint_names",
    "control_rate_hz",
    "command_path.delay_s",
    "command_path.lowpass_hz",
)


def make_all_limits(
    bundles: Sequence[Bundle], driver: Driver, dry_run: bool
) -> tuple[Limits, ...]:
    """Limits of each policy."""
    factory = driver.info.joint_limits_rad
    limits = tuple(make_limits(b.manifest, factory) for b in bundles)
    return tuple(x.without_motion() for x in limits) if dry_run else limits


def check_together(bundles: Sequence[Bundle]) -> None:
    """Refuses policies that cannot be switched between: other joints, rate or filter.

    Raises:
        InputError: naming bundle and field.
    """
    first = bundles[0].manifest.interface
    for bundle in bundles[1:]:
        other = bundle.manifest.interface
        for field in _SHARED:
            found, valid = (attrgetter(field)(x) for x in (other, first))
            if found != valid:
                where = f"interface.{field}"
                raise InputError(bundle.source, where, found, f"{valid}, as the first")


class Supervisor:
    """One run: the loop around `Core`.

    Args:
        options: `driver`, `bundles`, `loop_hz`, `record` (folder or None), `wiggle`,
            `realtime` (whether to ask for it).
        policy: link to the policy.
        console: link to the console.
        guard: link to the guard; nothing is armed before it watches.

    Raises:
        InputError: a bundle, the driver or the folder is refused.
    """

    def __init__(
        self,
        options: Mapping[str, Any],
        policy: socket.socket,
        console: socket.socket,
        guard: WatchedEnd,
    ):
        bundles = [load_bundle(path) for path in options["bundles"]]
        check_together(bundles)
        interface = bundles[0].manifest.interface
        self._console = ConsoleLink(console, len(bundles))
        self._guard = guard
        self._realtime = bool(options["realtime"])
        self._driver = open_driver(options["driver"], interface)
        try:
            dry = bool(options["driver"].get("dry_run")) or not self._driver.info.live
            self._live = not dry
            limits = make_all_limits(bundles, self._driver, dry)
            per_control = round(options["loop_hz"] / interface.control_rate_hz)
            self._period_s = 1.0 / (interface.control_rate_hz * per_control)
            self._driver.disable()
            self._recorder = _recorder(options, bundles, self._driver)
            self._core = Core(
                self._driver,
                SupervisorEnd(policy),
                limits,
                interface,
                per_control,
                time.monotonic,
                self._recorder,
                # Nothing follows in a dry run, so that there is nothing to compare.
                () if dry else tuple(options["wiggle"]),
            )
        except BaseException:
            self._driver.close()
            raise

    def run(self) -> int:
        """Runs until the operator quits and the hand is off; returns how it ended.

        Returns:
            0 after a stop by the operator, 5 after a fault.
        """
        realtime = prefer_this_process(ask=self._realtime)
        tripped: set[str] = set()
        try:
            ticker = Ticker(self._period_s)
            reported_s = ticker.start_s
            while not (self._console.quitting and self._core.over):
                tick = ticker.wait()
                operator, refused = self._operator(tick.t_s)
                out = self._core.tick(tick, operator)
                tripped |= {f.id for f in self._core.state.faults}
                events = (*refused, *out.events)
                if events or out.alarm or tick.t_s - reported_s >= STATUS_S:
                    reported_s = tick.t_s
                    self._console.report(self._status(realtime, events, out.alarm))
                if self._console.quitting and out.alarm:
                    return 5
                if self._driver.over:
                    over = (*out.events, "the recording is over")
                    self._console.report(self._status(realtime, over, alarm=False))
                    break
            # Never after an error, whatever the state says: then the guard looks.
            if self._core.over or not self._live:
                self._guard.farewell()
        finally:
            self._close(realtime)
        return 5 if tripped - {"OP", "OFF"} else 0

    def _operator(self, t: float) -> tuple[Operator, tuple[str, ...]]:
        """What the operator asks for, and why it is refused here."""
        self._guard.beat(t, os.getpid())
        self._guard.poll()
        operator = self._console.poll(t)
        if self._console.selected is not None:
            self._core.selected = self._console.selected
        self._core.keys = self._console.keys
        self._core.turned_rad = self._console.turned_rad
        if operator == Operator.ARM and not (self._guard.ready and self._guard.there):
            return Operator.NONE, ("arm refused: no guard watches",)
        gone = self._console.quitting or not self._guard.there
        if gone and self._core.state.mode in ENERGIZED and operator != Operator.OFF:
            operator = Operator.STOP
        return operator, ()

    def _close(self, realtime: str) -> None:
        self._driver.close()
        if self._recorder is not None:
            stats = self._core.stats
            numbers = {
                k: f"{v:.4g}" if isinstance(v, float) else str(v)
                for k, v in stats.summary().items()
            }
            self._recorder.close(
                {"realtime": realtime, **numbers, **stats.histograms()}
            )

    def _status(
        self, realtime: str, events: Sequence[str], alarm: bool
    ) -> dict[str, Any]:
        core, recorder = self._core, self._recorder
        return {
            "mode": core.state.mode.name.lower(),
            "faults": [str(fault) for fault in core.state.faults],
            "events": list(events),
            "alarm": alarm,
            "realtime": realtime,
            "timing_warning": core.stats.warning,
            "timing": core.stats.summary(),
            "memory_mb": resident_mb(),
            "checks": [[c.name, c.passed, c.found] for c in core.checks],
            "over": core.over,
            "recording": "" if recorder is None else str(recorder.files[-1]),
            "recording_error": "" if recorder is None else recorder.error,
        }


def _recorder(
    options: Mapping[str, Any], bundles: Sequence[Bundle], driver: Driver
) -> Recorder | None:
    if not options.get("record"):
        return None
    stem = time.strftime("run-%Y%m%d-%H%M%S")
    metadata = {
        "driver": driver.info.name,
        "tasks": ",".join(b.manifest.task for b in bundles),
        "policy_sha256": ",".join(b.manifest.policy.sha256 for b in bundles),
        "mounting": options.get("mounting", "free"),
        "loop_hz": repr(options["loop_hz"]),
        "lowpass_hz": repr(driver.info.lowpass_hz),
    }
    names = bundles[0].manifest.interface.joint_names
    folder = Path(options["record"])
    return Recorder(folder, stem, names, metadata, time.monotonic())


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the process: options as JSON; links to policy, console and guard."""
    text, *handles = sys.argv[1:] if arguments is None else arguments
    ignore_interrupts()
    policy, console, end = (socket.socket(fileno=int(handle)) for handle in handles)
    guard = WatchedEnd(end)
    try:
        supervisor = Supervisor(json.loads(text), policy, console, guard)
    except InputError as error:
        guard.farewell()
        print(error, file=sys.stderr)
        return 2
    except OSError as error:
        guard.farewell()
        print(f"driver: {error}", file=sys.stderr)
        return 6
    # What this raises is nobody's input: status 1, and the guard takes over.
    return supervisor.run()


if __name__ == "__main__":
    sys.exit(main())
