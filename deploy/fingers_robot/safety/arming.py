"""Arming: energize at the measured pose, wiggle, ramp to where the policy begins."""

import enum
from dataclasses import dataclass, replace

import numpy as np

from fingers_robot.reading import JOINT_COUNT, Array
from fingers_robot.safety.limits import Limits
from fingers_robot.safety.motion import ramp_duration, smooth_ramp
from fingers_robot.safety.types import Inputs
from fingers_robot.safety.wiggle import (
    Wiggle,
    start_wiggle,
    step_wiggle,
    wiggle_target,
)

ALL_JOINTS = tuple(range(JOINT_COUNT))
ENABLE_S = 1.0  # longest wait for the hand to confirm that it is energized
YIELD_S = 0.5  # a standing hand gives a little when it takes its own weight
REST_S = 0.2  # pause at the rest pose before the policy begins
RAMP_SPEED_RAD_S = 1.0


class Phase(enum.IntEnum):
    """Steps of arming, in order."""

    ENABLE = 0
    WIGGLE = 1
    RAMP = 2
    REST = 3


@dataclass(frozen=True, slots=True)
class Arming:
    """Where arming stands.

    Attributes:
        phase: the step.
        since_s: when it began [s].
        start_rad: targets when it began, [20].
        wiggle: the wiggle test; without joints once it is over.
    """

    phase: Phase
    since_s: float
    start_rad: Array
    wiggle: Wiggle


@dataclass(frozen=True, slots=True)
class Progress:
    """One step of arming: new state, targets, whether it is done, what is wrong."""

    arming: Arming
    target_rad: Array
    done: bool
    found: dict[str, str]


def start_arming(
    pose_rad: Array, t: float, limits: Limits, wiggle: tuple[int, ...]
) -> Arming:
    """Begins at the measured pose, which is the first target, whatever else is wanted.

    Args:
        pose_rad: measured angles, [20].
        t: monotonic time [s].
        limits: the limits.
        wiggle: joints to wiggle.
    """
    begin = start_wiggle(wiggle, pose_rad, pose_rad, t, limits.allowed_rad)
    return Arming(Phase.ENABLE, t, pose_rad, begin)


def step_arming(arming: Arming, inputs: Inputs, t: float, limits: Limits) -> Progress:
    """Advances arming by one step of the supervisor."""
    return _STEPS[arming.phase](arming, inputs, t, limits)


def _enable(arming: Arming, inputs: Inputs, t: float, limits: Limits) -> Progress:
    found: dict[str, str] = {}
    health, reading = inputs.health, inputs.reading
    if health is None or reading is None:
        return Progress(arming, arming.start_rad, False, found)
    apart = np.abs(health.pos_rad - reading.pos_rad)
    worst = int(apart.argmax())
    # Written so that NaN is a problem as well.
    if not apart[worst] <= limits.agreement_rad:
        found["S20"] = f"fast and slow angle of joint {worst} differ {apart[worst]:.3f}"
    elif t - arming.since_s > ENABLE_S:
        found["S20"] = "the hand did not confirm that it is energized"
    elif health.enabled and t - arming.since_s >= YIELD_S:
        start = arming.start_rad
        wiggle = start_wiggle(
            arming.wiggle.joints, start, reading.pos_rad, t, limits.allowed_rad
        )
        arming = Arming(Phase.WIGGLE, t, start, wiggle)
    return Progress(arming, arming.start_rad, False, found)


def _wiggle(arming: Arming, inputs: Inputs, t: float, limits: Limits) -> Progress:
    if not arming.wiggle.joints or inputs.reading is None:
        ramp = replace(arming, phase=Phase.RAMP, since_s=t)
        return Progress(ramp, arming.start_rad, False, {})
    pos = inputs.reading.pos_rad
    wiggle, problem = step_wiggle(arming.wiggle, pos, t, limits.allowed_rad)
    target = wiggle_target(wiggle, t) if wiggle.joints else arming.start_rad
    found = {"S17": problem} if problem else {}
    return Progress(replace(arming, wiggle=wiggle), target, False, found)


def _ramp(arming: Arming, inputs: Inputs, t: float, limits: Limits) -> Progress:
    start, goal = arming.start_rad, _begin_rad(arming, limits)
    duration = ramp_duration(start, goal, limits.settle_s, RAMP_SPEED_RAD_S)
    elapsed = t - arming.since_s
    target = smooth_ramp(start, goal, elapsed, duration)
    if elapsed >= duration:
        arming = replace(arming, phase=Phase.REST, since_s=t)
    return Progress(arming, target, False, {})


def _rest(arming: Arming, inputs: Inputs, t: float, limits: Limits) -> Progress:
    done = t - arming.since_s >= REST_S
    return Progress(arming, _begin_rad(arming, limits), done, {})


def _begin_rad(arming: Arming, limits: Limits) -> Array:
    """Targets with which the policy begins, all within the limits."""
    if not limits.begins_at_pose:
        return limits.rest_rad
    return np.clip(arming.start_rad, limits.allowed_rad[:, 0], limits.allowed_rad[:, 1])


_STEPS = {
    Phase.ENABLE: _enable,
    Phase.WIGGLE: _wiggle,
    Phase.RAMP: _ramp,
    Phase.REST: _rest,
}
