"""Readings of ROS messages: quantity, part, value in the SI units of ROS."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

Reading = tuple[str, str, float]


def joint_state(message: Any) -> Iterator[Reading]:
    """Yields `pos`, `vel` and `effort` of the joints of a `JointState`.

    Lists that are empty were not measured.

    Raises:
        ValueError: a list that is neither empty nor as long as the names.
    """
    names = list(message.name)
    lists = {"pos": message.position, "vel": message.velocity, "effort": message.effort}
    for quantity, values in lists.items():
        if len(values) not in (0, len(names)):
            raise ValueError(
                f"{len(values)} values of {quantity} for {len(names)} names"
            )
        for name, value in zip(names, values, strict=False):
            yield quantity, name, float(value)


def imu(message: Any) -> Iterator[Reading]:
    """Yields `gyro` and, where an orientation was estimated, `gravity` of an `Imu`.

    gravity = Rᵀ (0, 0, −1) with the orientation R of the sensor in the world, whose z
    points up (REP 103). A first covariance of −1 says that there is no estimate.
    """
    for axis in "xyz":
        yield "gyro", axis, float(getattr(message.angular_velocity, axis))
    if message.orientation_covariance[0] == -1.0:
        return
    q = message.orientation
    yield "gravity", "x", -2.0 * (q.x * q.z - q.w * q.y)
    yield "gravity", "y", -2.0 * (q.y * q.z + q.w * q.x)
    yield "gravity", "z", -(1.0 - 2.0 * (q.x * q.x + q.y * q.y))


def pose(message: Any) -> Iterator[Reading]:
    """Yields `base`: position and orientation of a `PoseStamped`."""
    for axis in "xyz":
        yield "base", axis, float(getattr(message.pose.position, axis))
    for part in "wxyz":
        yield "base", f"q{part}", float(getattr(message.pose.orientation, part))


READERS: Mapping[str, Callable[[Any], Iterator[Reading]]] = {
    "sensor_msgs/msg/JointState": joint_state,
    "sensor_msgs/msg/Imu": imu,
    "geometry_msgs/msg/PoseStamped": pose,
}
"""Reader of every message type that a log can take."""
