"""Upright detector: level and calm for a while."""

import math

from fingers_deploy.rotations import gravity, unrotate
from fingers_robot.reading import Array

MAX_TILT_RAD = math.radians(10.0)
MAX_SPEED_RAD_S = 4.0
DWELL_S = 0.5


def tilt_angle(quat_w: Array, v_quat_b: tuple[float, ...]) -> float:
    """Angle between V's z axis and up [rad], in [0, π]: stance-relative tilt."""
    down = unrotate(v_quat_b, gravity(quat_w))
    return math.acos(min(max(-float(down[2]), -1.0), 1.0))


def upright_step(
    since_s: float, tilt_rad: float, speed_rad_s: float, t: float
) -> tuple[float, bool]:
    """One step of the detector: tilt < 10° and speed < 4 rad/s for 0.5 s.

    Args:
        since_s: since when both have held [s]; infinite if they do not.
        tilt_rad: stance-relative tilt.
        speed_rad_s: norm of the angular velocity.
        t: monotonic time [s].

    Returns:
        The new `since_s`, and whether the hand is upright.
    """
    # Written so that NaN is not upright.
    if not (tilt_rad < MAX_TILT_RAD and speed_rad_s < MAX_SPEED_RAD_S):
        return math.inf, False
    since_s = min(since_s, t)
    return since_s, t - since_s >= DWELL_S - 1e-9
