"""The IMU port: samples of a sensor, turned into the palm frame and checked.

The sensor sits on the back of the hand, turned by a fixed rotation. It reports its
orientation and angular velocity in its own frame; gravity and rates in the palm frame
follow from the mounting alone.
"""

import math
import threading
import time
from typing import Protocol

import numpy as np

from fingers_deploy.errors import InputError
from fingers_deploy.rotations import conjugate, multiply, unrotate
from fingers_robot.reading import Array, ImuReading

_NORM_TOLERANCE = 1e-3


class RawImu(Protocol):
    """A sensor that waits for its next sample."""

    def wait(self) -> tuple[Array, Array]:
        """Blocks until a sample comes; returns orientation [4] and gyro [3] of it.

        The orientation is that of the sensor in a level world frame, w x y z; the
        angular velocity [rad/s] is in the sensor's frame.
        """
        ...

    def close(self) -> None:
        """Lets go of the device."""
        ...


class NoImu:
    """In the place of an IMU where nobody looks at one."""

    def read(self) -> None:
        """Has no sample."""

    def close(self) -> None:
        """Has nothing to let go of."""


class ImuPort:
    """Reads a sensor in a thread of its own and keeps the newest sample.

    Args:
        sensor: the sensor.
        mount_quat_b: orientation of the sensor in the palm frame, unit quaternion.

    Raises:
        InputError: the mounting is no unit quaternion.
    """

    def __init__(self, sensor: RawImu, mount_quat_b: tuple[float, ...]):
        norm = math.hypot(*mount_quat_b)
        if len(mount_quat_b) != 4 or not abs(norm - 1.0) <= _NORM_TOLERANCE:
            found = f"{mount_quat_b} with norm {norm:.3f}"
            raise InputError("IMU", "mounting", found, "a unit quaternion w x y z")
        self._sensor = sensor
        self._to_sensor = np.asarray(mount_quat_b)
        self._to_palm = conjugate(mount_quat_b)
        self._newest: ImuReading | None = None
        self._error: Exception | None = None
        self._open = True
        self._thread = threading.Thread(target=self._run, name="imu", daemon=True)
        self._thread.start()

    def read(self) -> ImuReading | None:
        """Returns the newest sample; raises what the sensor raised."""
        if self._error is not None:
            raise ConnectionError(f"IMU: {self._error}") from self._error
        return self._newest

    def close(self) -> None:
        """Ends the thread and lets go of the sensor."""
        self._open = False
        self._sensor.close()
        self._thread.join(timeout=1.0)

    def _run(self) -> None:
        while self._open:
            try:
                quat, gyro = self._sensor.wait()
            except Exception as error:
                self._error = error
                return
            self._newest = self._turn(quat, gyro)

    def _turn(self, quat_s: Array, gyro_s: Array) -> ImuReading:
        """Turns a sample into the palm frame: q_palm = q_sensor ⊗ mount*."""
        quat_w = multiply(quat_s, self._to_palm)
        gyro_b = unrotate(self._to_palm, gyro_s)
        return ImuReading(time.monotonic(), quat_w, gyro_b)
