"""Faults, by row of the safety table: each is put into a running lab from now on."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from faults.lab import Lab

from fingers_deploy.rotations import multiply
from fingers_robot.behaviour.command import Frame
from fingers_robot.reading import Health, ImuReading, Reading
from fingers_robot.safety import Mode, Operator

Rng = np.random.Generator
Install = Callable[[Lab, Rng], float | None]
"""Puts a fault into a lab; returns when it began, where that is not at once."""


@dataclass(frozen=True)
class Scenario:
    """One fault.

    Attributes:
        row: row of the table that must be latched first.
        name: what happens.
        install: puts it into a lab.
        within_s: longest time to the reaction on the wire.
        ends: mode in which it must end.
        ends_s: time by which it must be there [s].
    """

    row: str
    name: str
    install: Install
    within_s: float
    ends: Mode
    ends_s: float


def _samples(kind: type, change: Callable) -> Install:
    """Changes every sample of a kind; `change(sample, rng, t0, t)`."""

    def install(lab: Lab, rng: Rng) -> None:
        t0 = lab.clock.t

        def tamper(sample, t):
            return change(sample, rng, t0, t) if isinstance(sample, kind) else sample

        lab.driver.tamper = tamper

    return install


def _health(field: str, value: Callable[[Rng], float]) -> Install:
    """Changes one joint's entry of every slow read-back from the next one on."""

    def install(lab: Lab, rng: Rng) -> None:
        joint, number = int(rng.integers(20)), value(rng)

        def tamper(health: Health) -> Health:
            array = getattr(health, field).copy()
            array[joint] = number
            return replace(health, **{field: array})

        lab.driver.tamper_health = tamper

    return install


def _one_joint(kind: type, field: str, value: Callable[[Rng], float]) -> Install:
    """Sets one entry of a field of every sample, the same for the whole trial."""

    def install(lab: Lab, rng: Rng) -> None:
        size = {"gyro_b": 3}.get(field, 20)
        place, number = int(rng.integers(size)), value(rng)

        def change(sample, rng, t0, t):
            array = np.array(getattr(sample, field))
            array[place] = number
            return replace(sample, **{field: array})

        _samples(kind, change)(lab, rng)

    return install


def _late(sample, rng, t0, t):
    return replace(sample, t_s=min(sample.t_s, t0))


def _frozen(kind: type) -> Install:
    def install(lab: Lab, rng: Rng) -> None:
        kept: list = []

        def tamper(sample, t):
            if not isinstance(sample, kind):
                return sample
            kept.append(sample) if not kept else None
            return replace(kept[0], t_s=sample.t_s)

        lab.driver.tamper = tamper

    return install


def _bad_number(rng: Rng) -> float:
    return float(rng.choice([np.nan, np.inf, -np.inf]))


def _proposals(change: Callable) -> Install:
    def install(lab: Lab, rng: Rng) -> None:
        joint = int(rng.integers(20))
        lab.link.tamper = lambda proposal, t: change(proposal, rng, joint)

    return install


def _nan_target(proposal, rng, joint):
    target = proposal.target_rad.copy()
    target[joint] = _bad_number(rng)
    return replace(proposal, target_rad=target)


def _far_target(proposal, rng, joint):
    target = proposal.target_rad.copy()
    target[joint] += float(rng.choice([-1.0, 1.0])) * rng.uniform(0.3, 3.0)
    return replace(proposal, target_rad=target)


def _broken_network(lab: Lab, rng: Rng) -> None:
    lab.link.policies._controllers[0]._policy = lambda obs: np.full(
        20, _bad_number(rng), np.float32
    )


def _partial(proposal, rng, joint):
    return replace(proposal, target_rad=proposal.target_rad[:joint])


def _probe_lost(lab: Lab, rng: Rng) -> None:
    _samples(Health, _late)(lab, rng)


def _toppled(lab: Lab, rng: Rng) -> None:
    """A shove: the palm turns by 60° within 0.1 s, as the IMU sees it."""
    axis = rng.normal(size=3) * (1, 1, 0)
    axis /= np.linalg.norm(axis)

    def change(sample, rng, t0, t):
        half = 0.5 * np.deg2rad(60) * min((t - t0) / 0.1, 1.0)
        turn = np.array([np.cos(half), *(np.sin(half) * axis)])
        return replace(sample, quat_w=multiply(turn, sample.quat_w))

    _samples(ImuReading, change)(lab, rng)


def _blocked(lab: Lab, rng: Rng) -> None:
    """A finger is caught: a joint stays 0.3 rad off its target, where 0.25 may be."""
    joint = int(rng.integers(20))
    lab.core._limits = tuple(
        replace(x, tracking_rad=0.25, stall_s=np.inf, over_effort_s=np.inf)
        for x in lab.core._limits
    )

    def change(sample, rng, t0, t):
        pos, target = sample.pos_rad.copy(), lab.core.state.target_rad[joint]
        middle = lab.core.limits.allowed_rad[joint].mean()
        pos[joint] = target + (0.3 if target < middle else -0.3) + 1e-5 * rng.normal()
        return replace(sample, pos_rad=pos)

    _samples(Reading, change)(lab, rng)


_error_bit = _health("error_code", lambda r: 1 << int(r.choice([0, 3, 7, 8, 13])))


def _outside(lab: Lab, rng: Rng) -> None:
    """A joint is read beyond its limits, or a sensor of it says so, on either side."""
    joint = int(rng.integers(20))
    low, high = lab.core.limits.factory_rad[joint]
    far = rng.uniform(0.06, 2.0)
    number = low - far if rng.random() < 0.5 else high + far

    def change(sample, rng, t0, t):
        pos = sample.pos_rad.copy()
        pos[joint] = number
        return replace(sample, pos_rad=pos)

    _samples(Reading, change)(lab, rng)


class _Gone:
    """A gamepad whose frames stop."""

    def __init__(self, frame: Frame):
        self._frame = frame

    def poll(self, t: float) -> Frame:
        return self._frame


def _gamepad_lost(lab: Lab, rng: Rng) -> None:
    lab.link.policies.sources.command = _Gone(lab.source.poll(lab.clock.t))


def _hang(lab: Lab, rng: Rng) -> None:
    lab.link.silent = True


def _wrong_answers(proposal, rng, joint):
    return replace(proposal, response=proposal.response ^ (1 << joint))


def _killed(lab: Lab, rng: Rng) -> None:
    lab.link.open = False


def _raises(lab: Lab, rng: Rng) -> None:
    error = rng.choice([ConnectionError, TimeoutError, OSError, RuntimeError])

    def tamper(sample, t):
        raise error("unplugged")

    lab.driver.tamper = tamper
    lab.driver.refuse_write = error("unplugged")


def _write_raises(lab: Lab, rng: Rng) -> None:
    lab.driver.refuse_write = ConnectionError("unplugged")


def _slow_driver(lab: Lab, rng: Rng) -> float:
    """The supervisor itself is away for more than three control steps."""
    lab.tick(skip=round(rng.uniform(0.1, 0.4) / lab.period_s))
    return lab.clock.t


def _clock_back(lab: Lab, rng: Rng) -> float:
    lab.number -= round(rng.uniform(0.01, 5.0) / lab.period_s)
    lab.clock.t = lab.number * lab.period_s
    return lab.clock.t


def _flapping(lab: Lab, rng: Rng) -> None:
    hertz = rng.uniform(1, 50)

    def change(sample, rng, t0, t):
        if ((t - t0) * hertz) % 1 >= 0.5:
            return sample
        return replace(sample, pos_rad=np.full(20, np.nan))

    _samples(Reading, change)(lab, rng)


def _two_at_once(lab: Lab, rng: Rng) -> None:
    _hang(lab, rng)
    _error_bit(lab, rng)


def _while_settling(lab: Lab, rng: Rng) -> float:
    lab.tick(Operator.STOP)
    lab.run(rng.uniform(0.1, 1.0))
    lab.modes.clear()
    _raises(lab, rng)
    return lab.clock.t


HOLDING, SAFE = Mode.STOPPING, Mode.SAFE
SCENARIOS = (
    Scenario("S1", "late joints", _samples(Reading, _late), 0.060, SAFE, 0.52),
    Scenario("S1", "late IMU", _samples(ImuReading, _late), 0.060, SAFE, 0.52),
    Scenario("S2", "frozen joints", _frozen(Reading), 0.150, SAFE, 0.60),
    Scenario("S2", "frozen IMU", _frozen(ImuReading), 0.150, SAFE, 0.60),
    Scenario("S2b", "slow path silent", _probe_lost, 0.400, SAFE, 0.60),
    Scenario("S3", "bad angle", _one_joint(Reading, "pos_rad", _bad_number),
             0.020, SAFE, 0.10),
    Scenario("S3", "bad gyro", _one_joint(ImuReading, "gyro_b", _bad_number),
             0.020, SAFE, 0.10),
    Scenario("S3", "flapping NaN", _flapping, 0.020 + 0.5, SAFE, 1.6),
    Scenario("S4", "bad target", _proposals(_nan_target), 0.041, SAFE, 0.12),
    Scenario("S4", "far target", _proposals(_far_target), 0.041, SAFE, 0.12),
    Scenario("S4", "network gives NaN", _broken_network, 0.041, HOLDING, 0.3),
    Scenario("S5", "over-current",
             _one_joint(Reading, "effort_a", lambda r: r.uniform(1.06, 3.0)),
             0.050, SAFE, 0.20),
    Scenario("S5", "stall",
             _one_joint(Reading, "effort_a", lambda r: r.uniform(0.92, 1.0)),
             1.050, SAFE, 1.2),
    Scenario("S6", "effort limit changed", _health("effort_limit_a", lambda r: 1.5),
             0.600, SAFE, 2.4),
    Scenario("S6", "joint hot", _health("temperature_c", lambda r: r.uniform(80, 99)),
             0.600, SAFE, 2.4),
    Scenario("S6", "error bit", _error_bit, 0.600, SAFE, 2.4),
    Scenario("S7", "toppled", _toppled, 0.250, SAFE, 0.9),
    Scenario("S8", "joint outside", _outside, 0.060, HOLDING, 1.0),
    Scenario("S8b", "finger caught", _blocked, 0.560, HOLDING, 1.0),
    Scenario("S10", "gamepad lost", _gamepad_lost, 1.060, SAFE, 3.0),
    Scenario("S11", "policy hangs", _hang, 0.100, SAFE, 0.56),
    Scenario("S11", "wrong answers", _proposals(_wrong_answers), 0.100, SAFE, 0.56),
    Scenario("S12", "policy killed", _killed, 0.100, SAFE, 2.0),
    Scenario("S15", "unplugged", _raises, 0.100, SAFE, 0.1),
    Scenario("S15", "write fails", _write_raises, 0.100, SAFE, 0.1),
    Scenario("S18", "partial command", _proposals(_partial), 0.041, HOLDING, 1.0),
    Scenario("S19", "two at once", _two_at_once, 0.600, SAFE, 2.4),
    Scenario("S19", "while settling", _while_settling, 0.100, SAFE, 0.2),
    Scenario("L3", "supervisor away", _slow_driver, 0.100, HOLDING, 0.3),
    Scenario("L7", "clock back", _clock_back, 0.020, SAFE, 0.1),
)  # fmt: skip
"""S9, S13, S16, S17, S20 are tested in other ways, see `fault_matrix`."""
