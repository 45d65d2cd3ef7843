"""The WUJI hand, generation 1, through `wujihandpy`.

What this driver must know about that library:

- The real-time controller does not raise when the hand is gone: its cached angles just
  freeze. Only transactions on the slow path raise. Hence the slow path is a heartbeat.
- A slow transaction takes 5 to 10 ms and times out after 0.5 s by default, so it never
  runs in the loop, but in a thread (`slow_path`), under one lock.
- Arrays are [5, 4], finger by finger, J1 to J4, the order of our joint vector.
- The cached angles are zeros before the first frame.
- `Hand()` starts a check for upgrades in the background where standard error is a
  terminal; it needs no network to work.
- Firmware before 1.1 lets a question for its serial number run out after 3 s; before
  1.2 it reports no efforts, and reading them raises.
"""

import time
from typing import Any

import numpy as np

from fingers_deploy.errors import InputError
from fingers_deploy.manifest import Interface
from fingers_robot.drivers.protocol import Imu
from fingers_robot.drivers.slow_path import SlowPath
from fingers_robot.reading import (
    JOINT_COUNT,
    Array,
    DriverInfo,
    Health,
    ImuReading,
    Reading,
)

EFFORT_LIMIT_A = 1.0
LOWPASS_HZ = 3.0
_SHAPE = (5, 4)
_SIDES = {0: "right", 1: "left"}
_REPORTS_SERIAL = (1, 1)


class WujiDriver:
    """The hand and an IMU.

    Args:
        library: the module `wujihandpy`.
        interface: of the policy: joint names, which are `finger{1..5}_joint{1..4}`.
        imu: the IMU.
        side: "right" or "left"; a hand of the other side is refused.
        serial: serial number, where several hands are connected.

    Raises:
        InputError: other joint names, or a hand of the other side.
        ConnectionError: no hand, or it does not answer.
    """

    def __init__(
        self,
        library: Any,
        interface: Interface,
        imu: Imu,
        side: str = "right",
        serial: str | None = None,
    ):
        _check_names(interface)
        self._imu, self.over = imu, False
        self._controller: Any = None
        self._hand = library.Hand(serial_number=serial)
        self._hand.disable_thread_safe_check()
        self._check_side(side)
        self._hand.write_joint_enabled(False)
        self._hand.write_joint_effort_limit(EFFORT_LIMIT_A)
        low, high = (
            _flat(read())
            for read in (
                self._hand.read_joint_lower_limit,
                self._hand.read_joint_upper_limit,
            )
        )
        self.info = DriverInfo(
            name=f"WUJI {side} hand {self._serial()}",
            joint_names=interface.joint_names,
            joint_limits_rad=np.stack([low, high], axis=1),
            lowpass_hz=LOWPASS_HZ,
        )
        self._controller = self._hand.realtime_controller(
            enable_upstream=True, filter=library.filter.LowPass(cutoff_freq=LOWPASS_HZ)
        )
        self._slow = SlowPath(self._hand)

    def read(self) -> Reading:
        """Reads the library's cache, which 1 kHz upstream frames refresh.

        The cache has no time: that it is fresh must be judged by its changes.
        """
        pos = _flat(self._controller.get_joint_actual_position())
        effort = _flat(self._controller.get_joint_actual_effort())
        return Reading(time.monotonic(), pos, effort)

    def imu(self) -> ImuReading | None:
        """As the protocol says."""
        return self._imu.read()

    def health(self) -> Health | None:
        """As the protocol says; raises what the slow path raised."""
        return self._slow.health()

    def write(self, target_rad: Array) -> None:
        """As the protocol says; refuses what the library would cast to nonsense."""
        if target_rad.shape != (JOINT_COUNT,) or not np.isfinite(target_rad).all():
            raise ValueError("target that is not 20 finite numbers")
        self._controller.set_joint_target_position(target_rad.reshape(_SHAPE))

    def enable(self) -> None:
        """As the protocol says."""
        self._slow.ask_enabled(True)

    def disable(self) -> None:
        """As the protocol says."""
        self._slow.ask_enabled(False)

    def close(self) -> None:
        """De-energizes, waits for the slow path, closes controller and IMU."""
        if self._controller is None:
            return
        self._slow.close()
        self._controller.close()
        self._controller = None
        self._imu.close()

    def _check_side(self, side: str) -> None:
        code = int(self._hand.read_handedness())
        found = _SIDES.get(code, f"handedness {code}")
        if found != side:
            raise InputError("hand", "handedness", found, side)

    def _serial(self) -> str:
        """Serial number; firmware before 1.1 does not report it, after long asking."""
        version = int(self._hand.get_full_system_firmware_version())
        if (version & 0xFF, version >> 8 & 0xFF) < _REPORTS_SERIAL:
            return "of unknown serial number"
        return str(self._hand.get_product_sn())


def _check_names(interface: Interface) -> None:
    ours = tuple(f"finger{f}_joint{j}" for f in range(1, 6) for j in range(1, 5))
    for mine, theirs in zip(ours, interface.joint_names, strict=True):
        if not theirs.endswith(mine):
            field = "interface.joint_names"
            raise InputError("manifest", field, theirs, f"{mine}, as on this hand")


def _flat(array: Any) -> Array:
    flat = np.array(array, np.float64).reshape(-1)
    if flat.shape != (JOINT_COUNT,):
        raise ConnectionError(f"the hand answered for {flat.size} joints")
    return flat
