"""What puts a fault into a running lab, from now on."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from faults.lab import Lab

from fingers_deploy.rotations import multiply
from fingers_robot.behaviour.command import Frame
from fingers_robot.reading import ImuReading, Reading
from fingers_robot.safety import Operator, Proposal

Rng = np.random.Generator
Install = Callable[[Lab, Rng], float | None]
"""Puts a fault into a lab; returns when it began, where that is not at once."""


def samples(kind: type, change: Callable) -> Install:
    """Changes every sample of a kind; `change(sample, rng, t0, t)`."""

    def install(lab: Lab, rng: Rng) -> None:
        t0 = lab.clock.t

        def tamper(sample, t):
            return change(sample, rng, t0, t) if isinstance(sample, kind) else sample

        lab.driver.tamper = tamper

    return install


def health(field: str, value: Callable[[Rng], float]) -> Install:
    """Changes one joint's entry of every slow read-back from the next one on."""

    def install(lab: Lab, rng: Rng) -> None:
        joint, number = int(rng.integers(20)), value(rng)
        lab.driver.tamper_health = lambda h: _with(h, field, joint, number)

    return install


def one_entry(kind: type, field: str, value: Callable[[Rng], float]) -> Install:
    """Sets one entry of a field of every sample, the same for the whole trial."""

    def install(lab: Lab, rng: Rng) -> None:
        size = {"gyro_b": 3}.get(field, 20)
        place, number = int(rng.integers(size)), value(rng)
        change = lambda sample, *_: _with(sample, field, place, number)  # noqa: E731
        samples(kind, change)(lab, rng)

    return install


def _with(sample, field: str, place: int, number: float):
    """The sample with one entry of one field replaced."""
    array = np.array(getattr(sample, field))
    array[place] = number
    return replace(sample, **{field: array})


def late(sample, rng, t0, t):
    """No newer sample than that of the fault's begin."""
    return replace(sample, t_s=min(sample.t_s, t0))


def frozen(kind: type) -> Install:
    """The values of the first sample under newer times."""

    def install(lab: Lab, rng: Rng) -> None:
        kept: list = []

        def change(sample, rng, t0, t):
            kept.append(sample) if not kept else None
            return replace(kept[0], t_s=sample.t_s)

        samples(kind, change)(lab, rng)

    return install


def bad_number(rng: Rng) -> float:
    """NaN or an infinity."""
    return float(rng.choice([np.nan, np.inf, -np.inf]))


def proposals(change: Callable) -> Install:
    """Changes every proposal; `change(proposal, rng, joint)`."""

    def install(lab: Lab, rng: Rng) -> None:
        joint = int(rng.integers(20))
        lab.link.tamper = lambda proposal, t: change(proposal, rng, joint)

    return install


def nan_target(proposal: Proposal, rng: Rng, joint: int) -> Proposal:
    """One target is not finite."""
    return _with(proposal, "target_rad", joint, bad_number(rng))


def far_target(proposal: Proposal, rng: Rng, joint: int) -> Proposal:
    """One target jumps."""
    jump = float(rng.choice([-1.0, 1.0])) * rng.uniform(0.3, 3.0)
    return _with(proposal, "target_rad", joint, proposal.target_rad[joint] + jump)


def partial(proposal: Proposal, rng: Rng, joint: int) -> Proposal:
    """Targets of some joints only."""
    return replace(proposal, target_rad=proposal.target_rad[:joint])


def wrong_answers(proposal: Proposal, rng: Rng, joint: int) -> Proposal:
    """One bit of the response to the challenge is wrong."""
    return replace(proposal, response=proposal.response ^ (1 << joint))


def broken_network(lab: Lab, rng: Rng) -> None:
    """The network's output is not finite."""
    network = lambda obs: np.full(20, bad_number(rng), np.float32)  # noqa: E731
    lab.link.policies._controllers[0]._policy = network


def toppled(lab: Lab, rng: Rng) -> None:
    """A shove: the palm turns by 60° within 0.1 s, as the IMU sees it."""
    axis = rng.normal(size=3) * (1, 1, 0)
    axis /= np.linalg.norm(axis)

    def change(sample, rng, t0, t):
        half = 0.5 * np.deg2rad(60) * min((t - t0) / 0.1, 1.0)
        turn = np.array([np.cos(half), *(np.sin(half) * axis)])
        return replace(sample, quat_w=multiply(turn, sample.quat_w))

    samples(ImuReading, change)(lab, rng)


def blocked(lab: Lab, rng: Rng) -> None:
    """A finger is caught: a joint stays 0.3 rad off its target, where 0.25 may be."""
    joint = int(rng.integers(20))
    lab.core._limits = tuple(
        replace(x, tracking_rad=0.25, stall_s=np.inf, over_effort_s=np.inf)
        for x in lab.core._limits
    )

    def change(sample, rng, t0, t):
        target = lab.core.state.target_rad[joint]
        middle = lab.core.limits.allowed_rad[joint].mean()
        away = (0.3 if target < middle else -0.3) + 1e-5 * rng.normal()
        return _with(sample, "pos_rad", joint, target + away)

    samples(Reading, change)(lab, rng)


error_bit = health("error_code", lambda r: 1 << int(r.choice([0, 3, 7, 8, 13])))


def outside(lab: Lab, rng: Rng) -> None:
    """A joint is read beyond its limits, or a sensor of it says so, on either side."""
    joint = int(rng.integers(20))
    low, high = lab.core.limits.factory_rad[joint]
    far = rng.uniform(0.06, 2.0)
    number = low - far if rng.random() < 0.5 else high + far
    change = lambda sample, *_: _with(sample, "pos_rad", joint, number)  # noqa: E731
    samples(Reading, change)(lab, rng)


class _Gone:
    """A gamepad whose frames stop."""

    def __init__(self, frame: Frame):
        self._frame = frame

    def poll(self, t: float) -> Frame:
        return self._frame


def gamepad_lost(lab: Lab, rng: Rng) -> None:
    """No frame of the gamepad is newer than now."""
    lab.link.policies.sources.command = _Gone(lab.source.poll(lab.clock.t))


def hang(lab: Lab, rng: Rng) -> None:
    """The policy does not answer."""
    lab.link.silent = True


def killed(lab: Lab, rng: Rng) -> None:
    """The policy's end of the link is closed."""
    lab.link.open = False


def raises(lab: Lab, rng: Rng) -> None:
    """Every call of the driver raises."""
    error = rng.choice([ConnectionError, TimeoutError, OSError, RuntimeError])

    def tamper(sample, t):
        raise error("unplugged")

    lab.driver.tamper = tamper
    lab.driver.refuse_write = error("unplugged")


def write_raises(lab: Lab, rng: Rng) -> None:
    """Only sending targets raises."""
    lab.driver.refuse_write = ConnectionError("unplugged")


def slow_driver(lab: Lab, rng: Rng) -> float:
    """The supervisor itself is away for more than three control steps."""
    lab.tick(skip=round(rng.uniform(0.1, 0.4) / lab.period_s))
    return lab.clock.t


def clock_back(lab: Lab, rng: Rng) -> float:
    """The monotonic clock jumps back."""
    lab.number -= round(rng.uniform(0.01, 5.0) / lab.period_s)
    lab.clock.t = lab.number * lab.period_s
    return lab.clock.t


def flapping(lab: Lab, rng: Rng) -> None:
    """The joint angles are NaN in every second half-period."""
    hertz = rng.uniform(1, 50)

    def change(sample, rng, t0, t):
        if ((t - t0) * hertz) % 1 >= 0.5:
            return sample
        return replace(sample, pos_rad=np.full(20, np.nan))

    samples(Reading, change)(lab, rng)


def two_at_once(lab: Lab, rng: Rng) -> None:
    """The policy hangs, and an error bit is set."""
    hang(lab, rng)
    error_bit(lab, rng)


def while_settling(lab: Lab, rng: Rng) -> float:
    """The driver raises during the settle ramp."""
    lab.tick(Operator.STOP)
    lab.run(rng.uniform(0.1, 1.0))
    lab.modes.clear()
    raises(lab, rng)
    return lab.clock.t
