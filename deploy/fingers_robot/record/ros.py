"""CDR encodings of `sensor_msgs/JointState` and `sensor_msgs/Imu`.

With them, tools that know ROS 2 messages, and `fingers sysid`, read a recording without
knowing its rows. Positions within a message are aligned to the size of their type,
counted from behind the header of four bytes.
"""

import struct
from collections.abc import Sequence

import numpy as np

from fingers_robot.record.row import CDR_HEADER

JOINT_STATE, IMU = "sensor_msgs/msg/JointState", "sensor_msgs/msg/Imu"
COMMANDS_TOPIC, STATES_TOPIC = "/joint_commands", "/joint_states"
IMU_TOPIC = "/imu"

_SEPARATOR = "=" * 80
_HEADER = f"""{_SEPARATOR}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_SEPARATOR}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
JOINT_STATE_TEXT = f"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{_HEADER}"""
IMU_TEXT = f"""std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
{_HEADER}{_SEPARATOR}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
{_SEPARATOR}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""
_NOT_MEASURED = (-1.0, *(0.0,) * 8)  # covariance of what the message does not carry


class JointStates:
    """Encodes joint states of the same joints; `frame_id` is empty.

    Args:
        names: the joints.
    """

    def __init__(self, names: Sequence[str]):
        body = bytearray(struct.pack("<I", 1) + b"\0")  # frame_id, behind the stamp
        _pad(body, 4, offset=8)
        body += struct.pack("<I", len(names))
        for name in names:
            _pad(body, 4, offset=8)
            data = name.encode("ascii") + b"\0"
            body += struct.pack("<I", len(data)) + data
        _pad(body, 4, offset=8)
        self._names = bytes(body)

    def encode(
        self, time_ns: int, position: np.ndarray, effort: np.ndarray | None = None
    ) -> bytes:
        """Encodes one message; `position` and `effort` are [n]."""
        body = bytearray(_stamp(time_ns)) + self._names
        for values in (position, (), () if effort is None else effort):
            _pad(body, 4)
            body += struct.pack("<I", len(values))
            if len(values):
                _pad(body, 8)
                body += np.asarray(values, "<f8").tobytes()
        return CDR_HEADER + bytes(body)


def encode_imu(time_ns: int, quat_w: np.ndarray, gyro_b: np.ndarray) -> bytes:
    """Encodes one IMU message; no acceleration is measured.

    Args:
        time_ns: time stamp.
        quat_w: orientation w x y z, [4]; ROS has it x y z w.
        gyro_b: angular velocity [rad/s], [3].
    """
    body = bytearray(_stamp(time_ns)) + struct.pack("<I", 1) + b"\0"
    _pad(body, 8)
    w, x, y, z = quat_w.tolist()
    numbers = [x, y, z, w, *(0.0,) * 9, *gyro_b.tolist(), *(0.0,) * 9]
    numbers += [0.0, 0.0, 0.0, *_NOT_MEASURED]
    return CDR_HEADER + bytes(body) + np.array(numbers, "<f8").tobytes()


def _stamp(time_ns: int) -> bytes:
    seconds, rest = divmod(time_ns, 10**9)
    return struct.pack("<iI", seconds, rest)


def _pad(body: bytearray, size: int, offset: int = 0) -> None:
    body += bytes(-(len(body) + offset) % size)
