"""S9: packets that are lost on the way from the hand, at random and in bursts."""

import copy
from dataclasses import dataclass

import numpy as np
from faults.lab import Lab

from fingers_robot.reading import Health
from fingers_robot.safety import Mode, Operator

LOSSES = (0.0, 0.01, 0.05, 0.10, 0.20, 0.50)


@dataclass(frozen=True)
class Loss:
    """What one rate of loss showed: how often the hand was stopped."""

    share: float
    seconds: float
    trips: int


class LossyLink:
    """Loses each packet, with joints and IMU in it, with some probability."""

    def __init__(self, share: float, rng: np.random.Generator):
        self._share, self._rng = share, rng
        self._kept: dict[type, object] = {}
        self._t, self._lost = -1.0, False

    def __call__(self, sample, t):
        """Returns the newest sample that came through."""
        if isinstance(sample, Health):
            return sample
        if t != self._t:
            self._t, self._lost = t, bool(self._rng.random() < self._share)
        if not self._lost or type(sample) not in self._kept:
            self._kept[type(sample)] = sample
        return self._kept[type(sample)]


def measure_loss(start: Lab, share: float, seconds: float, seed: int) -> Loss:
    """Runs with losses; after a stop the operator clears and arms again."""
    lab = copy.deepcopy(start)
    lab.driver.tamper = LossyLink(share, np.random.default_rng(seed))
    trips, end = 0, lab.clock.t + seconds
    while lab.clock.t < end:
        lab.tick()
        if lab.mode in (Mode.STOPPING, Mode.SAFE):
            trips += 1
            _restart(lab)
    return Loss(share, seconds, trips)


def burst(start: Lab, seconds: float) -> tuple[float, Mode]:
    """Loses everything for a while; returns the time to the reaction, and the end."""
    lab = copy.deepcopy(start)
    t0 = lab.clock.t
    gone = LossyLink(1.0, np.random.default_rng(0))
    lab.driver.tamper = lambda s, t: gone(s, t) if t - t0 < seconds else s
    reaction = np.inf
    while lab.clock.t - t0 < 1.0:
        lab.tick()
        if lab.mode != Mode.ACTIVE:
            reaction = min(reaction, lab.clock.t - t0)
    return reaction, lab.mode


def _restart(lab: Lab) -> None:
    lab.tick(Operator.STOP)
    for operator in (Operator.CLEAR, Operator.ARM):
        for _ in range(round(4.0 / lab.period_s)):
            lab.tick()
        for _ in range(50):
            before = lab.mode
            lab.tick(operator)
            if lab.mode != before:
                break
    while lab.mode == Mode.ARMING:
        lab.tick()
