"""A whole run in virtual time: hand, supervisor, policy; with faults put between them.

Everything is the product's own code but for the clock, the socket, and the faults.
"""

import copy
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from fingers_deploy.bundle import Bundle
from fingers_deploy.controller import PolicyController
from fingers_robot.behaviour.command import FixedCommand
from fingers_robot.behaviour.exchange import Answer, Query
from fingers_robot.behaviour.policies import Policies
from fingers_robot.behaviour.sources import Sources
from fingers_robot.drivers.stand_in import sound_health
from fingers_robot.reading import DriverInfo, Health, ImuReading, Reading
from fingers_robot.runtime.core import Core
from fingers_robot.runtime.ticker import Tick
from fingers_robot.safety import Mode, Operator, make_limits
from fingers_robot.simulator.hand import SimulatedHand

ANSWER_S = 0.001


class Clock:
    """Virtual time [s]."""

    def __init__(self) -> None:
        self.t = 0.0

    def __call__(self) -> float:
        """Returns it."""
        return self.t


class LabDriver:
    """The simulated hand as a driver, in this process; `tamper` changes samples."""

    def __init__(self, hand: SimulatedHand, bundle: Bundle, clock: Clock):
        interface = bundle.manifest.interface
        self.hand, self._clock = hand, clock
        self.info = DriverInfo(
            "lab",
            interface.joint_names,
            hand.joint_limits_rad,
            interface.command_path.lowpass_hz,
        )
        self.tamper: Callable = lambda sample, t: sample
        self.tamper_health: Callable = lambda health: health
        self.refuse_write: Exception | None = None
        self.obeys_power = True
        self.written: list[tuple[float, np.ndarray]] = []
        self.powered: list[tuple[float, bool]] = []
        self._health_s = 0.0
        self._health: Health | None = None

    def read(self) -> Reading:
        """As the protocol says."""
        self.hand.advance(self._clock())
        self._packet = self.hand.state()
        t, p = self._clock(), self._packet
        return self.tamper(Reading(t, p["pos"], p["effort"]), t)

    def imu(self) -> ImuReading:
        """As the protocol says."""
        t, p = self._clock(), self._packet
        return self.tamper(ImuReading(t, p["quat"], p["gyro"]), t)

    def health(self) -> Health:
        """As the protocol says."""
        t = self._clock()
        if self._health is None or t - self._health_s >= 0.2:
            self._health_s, self._health = t, self.tamper_health(self._ask())
        return self.tamper(self._health, t)

    def write(self, target_rad: np.ndarray) -> None:
        """As the protocol says."""
        if self.refuse_write is not None:
            raise self.refuse_write
        self.written.append((self._clock(), target_rad.copy()))
        self.hand.target_rad = target_rad.copy()

    def enable(self) -> None:
        """As the protocol says."""
        self._power(True)

    def disable(self) -> None:
        """As the protocol says."""
        self._power(False)

    def close(self) -> None:
        """As the protocol says."""
        self._power(False)

    def _power(self, on: bool) -> None:
        self.powered.append((self._clock(), on))
        if self.obeys_power and self.hand.enabled != on:
            self.hand.set_enabled(on)
        self._health_s = -1.0

    def _ask(self) -> Health:
        return sound_health(self._clock(), self.hand.enabled, self._packet["pos"])


class LabLink:
    """Policy and link in this process; answers take a while; `tamper` changes them."""

    def __init__(self, policies: Policies, clock: Clock):
        self.policies, self._clock = policies, clock
        self.open = True
        self.silent = False
        self.delay_s = ANSWER_S
        self.tamper: Callable = lambda answer, t: answer
        self._due: list[tuple[float, Answer]] = []

    def send(self, query: Query) -> None:
        """Answers the query; the answer arrives later."""
        if self.open and not self.silent:
            answer = self.policies.answer(query)
            self._due.append((self._clock() + self.delay_s, answer))

    def poll(self) -> Answer | None:
        """Returns the newest answer that has arrived."""
        t = self._clock()
        arrived = [answer for due, answer in self._due if due <= t]
        self._due = [(due, answer) for due, answer in self._due if due > t]
        if not arrived or not self.open:
            return None
        answer = arrived[-1]
        proposal = self.tamper(answer.proposal, t)
        return None if proposal is None else replace(answer, proposal=proposal)


class Lab:
    """One run in virtual time.

    Args:
        model: MJCF of the hand.
        bundles: the policies.
        sticks: fixed sticks of the gamepad.
        loop_hz: rate of the supervisor's loop.
        wiggle: joints that arming wiggles.
        seed: of the sensor noise.
        limits: fields of the supervisor's limits to set.
    """

    def __init__(
        self,
        model: Path,
        bundles: tuple[Bundle, ...],
        sticks: tuple[float, ...] = (0.5, 0.0, 0.0),
        loop_hz: float = 500.0,
        wiggle: tuple[int, ...] = (),
        seed: int = 0,
        **limits: float,
    ):
        interface = bundles[0].manifest.interface
        chain = interface.command_path
        self.clock, self.period_s = Clock(), 1.0 / loop_hz
        hand = SimulatedHand(
            model,
            interface.joint_names,
            chain.delay_s,
            chain.lowpass_hz,
            interface.slews_rad_s,
            seed,
        )
        self.driver = LabDriver(hand, bundles[0], self.clock)
        controllers = tuple(PolicyController(b, "numpy") for b in bundles)
        self.source = FixedCommand(sticks)
        policies = Policies(controllers, Sources(self.source))
        self.link = LabLink(policies, self.clock)
        each = tuple(
            make_limits(b.manifest, hand.joint_limits_rad, **limits) for b in bundles
        )
        per_control = round(loop_hz / interface.control_rate_hz)
        self.core = Core(
            self.driver,
            self.link,
            each,
            interface,
            per_control,
            self.clock,
            wiggle=wiggle,
        )
        self.number = 0
        self.between: Callable[[], None] = lambda: None
        """What else happens in the world before each step."""
        self.events: list[tuple[float, str]] = []
        self.modes: list[tuple[float, Mode]] = []

    @property
    def mode(self) -> Mode:
        """Mode of the supervisor."""
        return self.core.state.mode

    def tick(self, operator: Operator = Operator.NONE, skip: int = 0) -> None:
        """One step of the loop, after `skip` that were missed."""
        self.number += 1 + skip
        self.clock.t = self.number * self.period_s
        self.between()
        out = self.core.tick(Tick(self.number, self.clock.t, 0.0, skip), operator)
        self.events += [(self.clock.t, line) for line in out.events]
        if not self.modes or self.modes[-1][1] != self.mode:
            self.modes.append((self.clock.t, self.mode))

    def run(self, seconds: float) -> "Lab":
        """Steps for some time."""
        for _ in range(round(seconds / self.period_s)):
            self.tick()
        return self

    def activate(self) -> "Lab":
        """Arms and waits until the policy runs."""
        self.run(0.3)
        self.tick(Operator.ARM)
        for _ in range(round(40.0 / self.period_s)):
            self.tick()
            if self.mode == Mode.ACTIVE:
                return self
        raise RuntimeError(f"not armed: {self.core.checks} {self.events}")

    def forget(self) -> None:
        """Drops what was recorded about the wire so far."""
        self.driver.written.clear()
        self.driver.powered.clear()
        self.events.clear()
        self.modes = [(self.clock.t, self.mode)]


def snapshots(lab: Lab, count: int, spacing_s: float) -> list[Lab]:
    """Copies of an active run at different phases of the gait."""
    copies = []
    for _ in range(count):
        lab.run(spacing_s)
        lab.forget()
        copies.append(copy.deepcopy(lab))
    return copies
