"""Heading hold: yaw-rate command from the IMU's heading."""

import math
import re
from dataclasses import dataclass

from fingers_deploy.rotations import Vector

_TURNING = 0.02  # a commanded rate above this steers, below it the heading is held
_DEGREES = re.compile(r"[+-]?[0-9]{1,3}(\.[0-9]{1,3})?", re.ASCII)
MOST_DEG = 180.0
"""Largest turn that an operator may ask for at once: beyond it the way round is shorter
[deg]."""


@dataclass(frozen=True)
class HeadingConfig:
    """Gains of the heading hold.

    Attributes:
        gain: yaw rate per heading error [1/s].
        offset_rad_s: added to the commanded rate, against a constant drift.
        low, high: training range of the yaw-rate command [rad/s].
    """

    gain: float
    offset_rad_s: float
    low: float
    high: float


def heading_step(
    reference_rad: float | None,
    heading_rad: float,
    asked_rad_s: float,
    c: HeadingConfig,
) -> tuple[float | None, float]:
    """One step: ω = clip(k·wrap(ψ_ref − ψ) + ω₀, low, high).

    While the operator turns, his rate passes with the offset, and the reference follows
    the heading: the hand goes on in the direction in which he lets go.

    Args:
        reference_rad: heading that is held; None before the first step.
        heading_rad: measured heading of V.
        asked_rad_s: the operator's yaw rate.
        c: the gains.

    Returns:
        The new reference, and the yaw-rate command [rad/s].
    """
    if reference_rad is None or abs(asked_rad_s) > _TURNING:
        rate = asked_rad_s + c.offset_rad_s
        return heading_rad, min(max(rate, c.low), c.high)
    rate = c.gain * wrap(reference_rad - heading_rad) + c.offset_rad_s
    return reference_rad, min(max(rate, c.low), c.high)


def turn_of(text: str) -> float | None:
    """Returns a turn that was typed in degrees [rad]; None if it is none."""
    if not _DEGREES.fullmatch(text) or abs(float(text)) > MOST_DEG:
        return None
    return math.radians(float(text))


def heading(quat_w: Vector) -> float:
    """Angle of the frame's x axis about the world's up direction [rad], in (−π, π]."""
    w, x, y, z = quat_w
    return math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))


def wrap(angle_rad: float) -> float:
    """The same angle in [−π, π)."""
    return (angle_rad + math.pi) % (2 * math.pi) - math.pi
