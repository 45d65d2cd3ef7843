"""One row of the log: what an identification or a replay needs of one step.

The row is a message of fixed size, so that its CDR encoding, as ROS 2 uses it, is a
plain little-endian record behind a header of four bytes: no padding falls between the
fields, because they come in the order of their alignment.
"""

import numpy as np

from fingers_robot.reading import JOINT_COUNT

SCHEMA_VERSION = 1
SCHEMA_NAME = "fingers_msgs/msg/LogRow"
TOPIC = "/fingers/log"
CDR_HEADER = b"\x00\x01\x00\x00"

_FIELDS = (
    # name, ROS type, NumPy type, entries, meaning
    ("t", "float64", "<f8", 1, "monotonic time since the start of the run [s]"),
    ("unix_s", "float64", "<f8", 1, "wall clock, which may jump [s]"),
    ("cmd", "float32", "<f4", JOINT_COUNT, "joint targets sent [rad]"),
    ("pos", "float32", "<f4", JOINT_COUNT, "measured joint angles [rad]"),
    ("cur", "float32", "<f4", JOINT_COUNT, "effort in current space [A]"),
    ("temp", "float32", "<f4", JOINT_COUNT, "joint temperatures [degC]"),
    ("gravity", "float32", "<f4", 3, "unit gravity in the palm frame"),
    ("gyro", "float32", "<f4", 3, "angular velocity in the palm frame [rad/s]"),
    ("quat", "float32", "<f4", 4, "orientation of the palm, w x y z"),
    ("command", "float32", "<f4", 9, "task inputs given to the policy"),
    ("supply", "float32", "<f4", 1, "supply voltage [V]"),
    ("late_s", "float32", "<f4", 1, "start of this step after its deadline [s]"),
    ("work_s", "float32", "<f4", 1, "duration of the step before [s]"),
    ("answer_s", "float32", "<f4", 1, "observation sent to proposal received [s]"),
    ("skipped", "uint32", "<u4", 1, "control steps skipped so far"),
    ("tick", "uint32", "<u4", 1, "number of the control step"),
    ("mode", "uint8", "<u1", 1, "0 disabled 1 arming 2 active 3 stopping 4 safe"),
    ("reaction", "uint8", "<u1", 1, "0 none 1 hold 2 settle 3 disable"),
    ("policy", "uint8", "<u1", 1, "number of the policy that is selected"),
    ("enabled", "uint8", "<u1", 1, "1 while the hand confirms that it is energized"),
)
NAMES = tuple(name for name, *_ in _FIELDS)
ROW = np.dtype(
    [
        (name, kind) if count == 1 else (name, kind, (count,))
        for name, _, kind, count, _ in _FIELDS
    ]
)
"""The record behind the header."""


def schema_text() -> str:
    """The message definition, as ROS 2 writes it."""
    lines = [
        f"# {meaning}\n{kind}{f'[{count}]' if count > 1 else ''} {name}"
        for name, kind, _, count, meaning in _FIELDS
    ]
    return "\n".join(lines) + "\n"


def empty_row() -> np.ndarray:
    """A row in which every measurement is still unknown (NaN)."""
    row = np.zeros((), ROW)
    for name, _, kind, _, _ in _FIELDS:
        if kind[1] == "f":
            row[name] = np.nan
    return row
