"""One step of the supervisor's process: read, judge, write, ask the policy, record."""

import dataclasses
import time
from collections import deque
from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fingers_deploy.manifest import Interface
from fingers_deploy.rotations import gravity
from fingers_robot.behaviour.exchange import COMMANDS, Answer, Query
from fingers_robot.drivers.protocol import Driver
from fingers_robot.reading import JOINT_COUNT, Health, ImuReading, Reading
from fingers_robot.record.row import empty_row
from fingers_robot.runtime.preflight import Check, preflight
from fingers_robot.runtime.stats import LoopStats
from fingers_robot.runtime.ticker import Tick
from fingers_robot.safety.arming import ALL_JOINTS
from fingers_robot.safety.latch import severest
from fingers_robot.safety.limits import Limits
from fingers_robot.safety.machine import initial_state, step
from fingers_robot.safety.types import Inputs, Mode, Operator, Outputs

Sample = tuple[Reading | None, ImuReading | None, Health | None, str]
_UNKNOWN = np.full(JOINT_COUNT, np.nan)


class Link(Protocol):
    """The supervisor's end of the link to the policy."""

    open: bool

    def send(self, query: Query) -> None:
        """Sends a query; never blocks."""
        ...

    def poll(self) -> Answer | None:
        """Returns the newest answer since the last call."""
        ...


class Sink(Protocol):
    """Where rows and events go."""

    def row(self, t_s: float, row: np.ndarray) -> None:
        """Takes a row."""
        ...

    def event(self, t_s: float, line: str) -> None:
        """Takes an event."""
        ...


class Core:
    """Driver, supervisor and link of one run; the caller brings the clock.

    Args:
        driver: the hand.
        link: to the policy.
        limits: for each policy, in the order of their numbers.
        interface: of the policies: joints and control path.
        steps_per_control: steps of this loop per control step.
        sink: takes rows and events; None: nothing is recorded.
        wiggle: joints that arming wiggles.
        now: monotonic time [s].
    """

    def __init__(
        self,
        driver: Driver,
        link: Link,
        limits: tuple[Limits, ...],
        interface: Interface,
        steps_per_control: int,
        now: Callable[[], float],
        sink: Sink | None = None,
        wiggle: tuple[int, ...] = ALL_JOINTS,
    ):
        self._driver, self._link, self._sink = driver, link, sink
        self._interface, self._now = interface, now
        self._limits, self._policy = limits, 0
        self._per_control = steps_per_control
        self._period_s = 1.0 / (interface.control_rate_hz * steps_per_control)
        self._start_s = now()
        self._last_s: float | None = None
        self.state = initial_state(limits[0], self._start_s, wiggle)
        self.stats = LoopStats()
        self.checks: tuple[Check, ...] = ()
        self.selected = 0
        self.keys: deque[int] = deque()
        """That the operator asks for, the next one first."""
        self.turned_rad = 0.0
        """Sum of the turns that he has asked for."""
        self._write_error = ""
        self._sent: dict[int, float] = {}
        self._row = empty_row()
        self._last_control = 0
        self._command = np.full(COMMANDS, np.nan, np.float32)

    @property
    def limits(self) -> Limits:
        """Those of the policy that answered last."""
        return self._limits[self._policy]

    def tick(self, tick: Tick, operator: Operator = Operator.NONE) -> Outputs:
        """Does one step.

        Args:
            tick: the deadline that was waited for.
            operator: what the operator asked since the step before.
        """
        t = tick.t_s
        if self._last_s is not None:
            self.stats.gap.add(t - self._last_s)
        self._last_s = t
        control, skipped = self._control(tick)
        reading, imu, health, error = self._read()
        answer = self._poll(t)
        inputs = Inputs(
            reading=reading,
            imu=imu,
            health=health,
            proposal=None if answer is None else answer.proposal,
            link_open=self._link.open,
            operator=operator,
            driver_error=error,
            skipped_ticks=skipped,
            control_tick=control,
        )
        if operator == Operator.ARM:
            self.checks = preflight(
                self._driver.info, inputs, self._interface, self.limits, t
            )
        ready = bool(self.checks) and all(c.passed for c in self.checks)
        inputs = dataclasses.replace(inputs, preflight_ok=ready)
        self.state, out = step(self.state, inputs, t, self.limits)
        self._apply(out)
        if control >= 0:
            late_s = self._late(control, tick)
            self._ask(control, inputs, out, t)
            self._record(control, late_s, inputs, t)
            self.stats.step(late_s, skipped, late_s + self._now() - t)
        if self._sink is not None:
            for line in out.events:
                self._sink.event(t, line)
        self.stats.work.add(self._now() - t)
        return out

    def _control(self, tick: Tick) -> tuple[int, int]:
        """Number of the control step that is due, or −1, and how many were skipped."""
        number = tick.number // self._per_control
        if number <= self._last_control:
            return -1, 0
        skipped = number - self._last_control - 1
        self._last_control = number
        return number, skipped

    def _late(self, control: int, tick: Tick) -> float:
        """How long after its own deadline a control step starts [s].

        Where steps of the loop were skipped, that is more than the tick was late.
        """
        return (
            tick.number - control * self._per_control
        ) * self._period_s + tick.late_s

    def _read(self) -> Sample:
        try:
            samples = self._driver.read(), self._driver.imu(), self._driver.health()
        except Exception as error:
            return None, None, None, f"{type(error).__name__}: {error}"
        error, self._write_error = self._write_error, ""
        return *samples, error

    def _poll(self, t: float) -> Answer | None:
        answer = self._link.poll()
        if answer is not None:
            # The policy process may say which of the two it runs, not choose another.
            if answer.policy in {0, min(self.selected, len(self._limits) - 1)}:
                self._policy = answer.policy
            self._command = answer.command
            sent = self._sent.pop(answer.proposal.tick, None)
            if sent is not None:
                self.stats.answer.add(t - sent)
                self._row["answer_s"] = t - sent
        return answer

    def _apply(self, out: Outputs) -> None:
        try:
            if out.enable is False:
                self._driver.disable()
            if out.target_rad is not None:
                self._driver.write(out.target_rad)
            if out.enable is True:
                self._driver.enable()
        except Exception as error:
            self._write_error = f"{type(error).__name__}: {error}"

    def _ask(self, control: int, inputs: Inputs, out: Outputs, t: float) -> None:
        reading, imu = inputs.reading, inputs.imu
        query = Query(
            tick=control,
            t_s=t,
            joint_pos=_UNKNOWN if reading is None else reading.pos_rad,
            quat_w=_UNKNOWN[:4] if imu is None else imu.quat_w,
            gyro_b=_UNKNOWN[:3] if imu is None else imu.gyro_b,
            target_rad=self.state.target_rad,
            runs=out.policy_runs,
            policy=self.selected,
            key=self.keys.popleft() + 1 if self.keys else 0,
            turned_rad=self.turned_rad,
            challenge=out.challenge,
        )
        self._sent = {control: t}
        self._link.send(query)

    def _record(self, control: int, late_s: float, inputs: Inputs, t: float) -> None:
        if self._sink is None:
            return
        row = self._row
        row["t"], row["unix_s"] = t - self._start_s, time.time()
        row["cmd"] = self.state.target_rad
        row["pos"], row["cur"] = _joints(inputs.reading)
        _fill_imu(row, inputs.imu)
        health = inputs.health
        row["temp"] = np.nan if health is None else health.temperature_c
        row["supply"] = np.nan if health is None else health.bus_v
        row["enabled"] = health is not None and health.enabled
        row["command"] = self._command
        row["late_s"], row["skipped"] = late_s, self.stats.skipped
        row["tick"], row["policy"] = control, self._policy
        row["mode"] = self.state.mode
        row["reaction"] = severest(self.state.faults)
        self._sink.row(t, row)
        row["answer_s"] = np.nan
        row["work_s"] = self._now() - t  # shown in the next row

    @property
    def over(self) -> bool:
        """De-energized and confirmed: nothing more to watch."""
        return self.state.mode in (Mode.DISABLED, Mode.SAFE) and self.state.confirmed


def _joints(reading: Reading | None) -> tuple[NDArray, NDArray]:
    if reading is None:
        return _UNKNOWN, _UNKNOWN
    return reading.pos_rad, reading.effort_a


def _fill_imu(row: np.ndarray, imu: ImuReading | None) -> None:
    if imu is None:
        row["quat"] = row["gyro"] = row["gravity"] = np.nan
        return
    row["quat"], row["gyro"] = imu.quat_w, imu.gyro_b
    row["gravity"] = gravity(imu.quat_w)
