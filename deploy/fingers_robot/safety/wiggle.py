"""The wiggle test: each joint in turn moves a little, and only that joint may move.

It finds a wrong joint order, a wrong sign, a left hand, a stuck joint.
"""

from dataclasses import dataclass, replace

import numpy as np

from fingers_robot.reading import Array

AMPLITUDE_RAD = 0.05
FOLLOWED_RAD = 0.025  # the moved joint must get at least half way
OTHERS_RAD = 0.03  # and no other may move by more; a standing hand gives a little
_RAMP_S, _OUT_S, _BACK_S = 0.1, 0.45, 0.35


@dataclass(frozen=True, slots=True)
class Wiggle:
    """Where the test stands.

    Attributes:
        joints: joints still to be moved; the first one moves now.
        start_s: when it began to move [s].
        base_rad: targets around which it moves, [20].
        pose_rad: measured angles when it began, [20].
        sign: direction of the motion, +1 or −1.
        checked: the outward motion has been judged.
    """

    joints: tuple[int, ...]
    start_s: float
    base_rad: Array
    pose_rad: Array
    sign: float
    checked: bool = False


def start_wiggle(
    joints: tuple[int, ...], base_rad: Array, pos_rad: Array, t: float, limits: Array
) -> Wiggle:
    """Begins with the first of `joints`, away from its nearer limit ([20, 2])."""
    sign = 1.0
    if joints:
        low, high = limits[joints[0]]
        sign = 1.0 if base_rad[joints[0]] <= (low + high) / 2 else -1.0
    return Wiggle(joints, t, base_rad, pos_rad, sign)


def wiggle_target(wiggle: Wiggle, t: float) -> Array:
    """Targets at time `t`, [20]: out within 0.1 s, back likewise."""
    elapsed = t - wiggle.start_s
    out = min(elapsed / _RAMP_S, 1.0, max(0.0, (_OUT_S - elapsed) / _RAMP_S + 1.0))
    target = wiggle.base_rad.copy()
    target[wiggle.joints[0]] += wiggle.sign * AMPLITUDE_RAD * out
    return target


def step_wiggle(
    wiggle: Wiggle, pos_rad: Array, t: float, limits: Array
) -> tuple[Wiggle, str]:
    """Advances the test.

    Args:
        wiggle: the state; with at least one joint.
        pos_rad: measured angles, [20].
        t: monotonic time [s].
        limits: joint limits, [20, 2].

    Returns:
        The new state, without joints when the test is over, and what is wrong (empty
        if nothing).
    """
    elapsed = t - wiggle.start_s
    if elapsed >= _OUT_S and not wiggle.checked:
        problem = _judge(wiggle, pos_rad)
        return replace(wiggle, checked=True), problem
    if elapsed >= _OUT_S + _BACK_S:
        rest = wiggle.joints[1:]
        return start_wiggle(rest, wiggle.base_rad, pos_rad, t, limits), ""
    return wiggle, ""


def _judge(wiggle: Wiggle, pos_rad: Array) -> str:
    joint = wiggle.joints[0]
    moved = pos_rad - wiggle.pose_rad
    if not wiggle.sign * moved[joint] >= FOLLOWED_RAD:
        return f"joint {joint} moved by {moved[joint]:.3f} instead of 0.05 rad"
    others = np.abs(moved)
    others[joint] = 0.0
    worst = int(others.argmax())
    if not others[worst] <= OTHERS_RAD:
        return f"joint {worst} moved by {moved[worst]:.3f} rad with joint {joint}"
    return ""
