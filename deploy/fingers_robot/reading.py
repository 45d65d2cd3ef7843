"""What a driver delivers: joints, IMU, health, and what kind of hand it is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
JOINT_COUNT = 20
"""Of the hand that this side is made for; the shim takes any number."""


@dataclass(frozen=True, slots=True)
class Reading:
    """The newest sample of the joints.

    Attributes:
        t_s: monotonic time at which it was taken, as far as the driver can know [s].
        pos_rad: joint angles, in the order of `DriverInfo.joint_names`, [20].
        effort_a: actuation in the space of motor current [A], [20].
    """

    t_s: float
    pos_rad: Array
    effort_a: Array


@dataclass(frozen=True, slots=True)
class ImuReading:
    """The newest sample of the IMU, turned into the palm frame.

    Attributes:
        t_s: monotonic time of arrival [s].
        quat_w: orientation of the palm in a level world frame, w x y z, [4].
        gyro_b: angular velocity of the palm in the palm frame [rad/s], [3].
    """

    t_s: float
    quat_w: Array
    gyro_b: Array


@dataclass(frozen=True, slots=True)
class Health:
    """The newest slow read-back, 2 to 5 times a second, on a path of its own.

    Attributes:
        t_s: monotonic time at which the read-back began [s]; its values are no older.
        enabled: the joints are energized: every one of them, as the hand confirmed it.
        disabled: no joint is energized, as the hand confirmed it.
        temperature_c: joint temperatures [°C], [20].
        bus_v: supply voltage [V].
        error_code: error bits of each joint, zero without a fault, [20].
        effort_limit_a: effort limits read back [A], [20].
        pos_rad: joint angles over the slow path [rad], [20].
    """

    t_s: float
    enabled: bool
    disabled: bool
    temperature_c: Array
    bus_v: float
    error_code: NDArray[np.uint32]
    effort_limit_a: Array
    pos_rad: Array


@dataclass(frozen=True, slots=True)
class DriverInfo:
    """What does not change while a driver is open.

    Attributes:
        name: driver and device, for the log.
        joint_names: the joints, in the order of every joint vector.
        joint_limits_rad: factory limits of the joints, [20, 2].
        lowpass_hz: cutoff of the command low-pass that the driver has set [Hz].
        live: moves a hand (or a simulated one); false for a replay.
    """

    name: str
    joint_names: tuple[str, ...]
    joint_limits_rad: Array
    lowpass_hz: float | None
    live: bool = True
