"""S7 over-tilt."""

import math

from fingers_deploy.rotations import gravity, tilt, unrotate
from fingers_robot.safety.detectors.sensors import valid_imu
from fingers_robot.safety.limits import Limits
from fingers_robot.safety.types import Found, Inputs


def detect_tilt(
    since_s: float, inputs: Inputs, t: float, limits: Limits
) -> tuple[float, Found]:
    """Looks at roll and pitch of V against level.

    Args:
        since_s: since when the tilt has been beyond its limit [s]; infinite: it is not.
        inputs: inputs of this step.
        t: monotonic time [s].
        limits: the limits.

    Returns:
        The new `since_s` and what was found.
    """
    imu = inputs.imu
    if imu is None or not valid_imu(imu):
        return math.inf, {}
    roll, pitch = tilt(unrotate(limits.v_quat_b, gravity(imu.quat_w)))
    if abs(roll) <= limits.max_roll_rad and abs(pitch) <= limits.max_pitch_rad:
        return math.inf, {}
    since_s = min(since_s, t)
    if t - since_s < limits.tilt_s:
        return since_s, {}
    angles = f"roll {math.degrees(roll):.0f}°, pitch {math.degrees(pitch):.0f}°"
    return since_s, {"S7": angles}
