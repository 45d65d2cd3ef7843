"""A hand that is always where it was sent, level and at rest."""

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from fingers_deploy.manifest import Interface
from fingers_robot.reading import DriverInfo, Health, ImuReading, Reading


class IdealHand:
    """Reaches every target at once.

    Args:
        interface: of the policy, with the names and the number of joints.
    """

    over = False

    def __init__(self, interface: Interface):
        joints = tuple(interface.joint_names)
        limits_rad = np.tile([-1.5, 1.5], (len(joints), 1))
        self.info = DriverInfo("ideal", joints, limits_rad, lowpass_hz=None)
        self._pos_rad, self._on = np.zeros(len(joints)), False

    def read(self) -> Reading:
        """The joints."""
        effort_a = np.zeros_like(self._pos_rad)
        return Reading(time.monotonic(), self._pos_rad, effort_a=effort_a)

    def imu(self) -> ImuReading:
        """Level and at rest."""
        level = np.array([1.0, 0.0, 0.0, 0.0])
        return ImuReading(time.monotonic(), level, gyro_b=np.zeros(3))

    def health(self) -> Health:
        """In good health."""
        count = len(self._pos_rad)
        return Health(
            t_s=time.monotonic(),
            enabled=self._on,
            disabled=not self._on,
            temperature_c=np.full(count, 25.0),
            bus_v=12.0,
            error_code=np.zeros(count, np.uint32),
            effort_limit_a=np.ones(count),
            pos_rad=self._pos_rad,
        )

    def write(self, target_rad: np.ndarray) -> None:
        """Goes there, if it is energized."""
        if self._on:
            self._pos_rad = np.array(target_rad)

    def enable(self) -> None:
        """Energizes it."""
        self._on = True

    def disable(self) -> None:
        """Takes its power away."""
        self._on = False

    close = disable


def open_ideal(options: Mapping[str, Any], interface: Interface) -> IdealHand:
    """Opens the hand; `options["device"]` would say where a real one is."""
    del options
    return IdealHand(interface)
