"""BNO085 over I²C: game rotation vector and calibrated gyroscope, 100 Hz each.

The sensor speaks SHTP: each transfer begins with a header of four bytes (length, with
the top bit for a continued cargo; channel; sequence number). Features are switched on
by a report on the control channel; samples come on channel 3 as a time base followed by
input reports. Fixed-point formats: rotation vector Q14, gyroscope Q9 [rad/s].
"""

import fcntl
import os
import struct
import time
from collections.abc import Callable

import numpy as np

from fingers_robot.reading import Array

GYROSCOPE, GAME_ROTATION = 0x02, 0x08
_I2C_SLAVE = 0x0703
_HEADER = struct.Struct("<HBB")
_SET_FEATURE = struct.Struct("<BBBHIII")
_CONTROL, _REPORTS = 2, 3
_TIME_BASE, _TIME_BASE_BYTES, _REBASE = 0xFB, 5, 0xFA
_LENGTHS = {GYROSCOPE: 10, GAME_ROTATION: 12}
_LONGEST = 512
_TIMEOUT_S = 0.5


class I2cBus:
    """A device on an I²C bus of Linux, without any library.

    Args:
        bus: number of the bus, 1 on a Raspberry Pi.
        address: of the device; the BNO085 has 0x4A or 0x4B.
    """

    def __init__(self, bus: int = 1, address: int = 0x4A):
        self._file = os.open(f"/dev/i2c-{bus}", os.O_RDWR)
        fcntl.ioctl(self._file, _I2C_SLAVE, address)

    def read(self, count: int) -> bytes:
        """Reads bytes."""
        return os.read(self._file, count)

    def write(self, data: bytes) -> None:
        """Writes bytes."""
        os.write(self._file, data)

    def close(self) -> None:
        """Lets go of the bus."""
        os.close(self._file)


class Bno085:
    """The sensor, as `imu_port.RawImu`.

    Args:
        bus: has `read(count)`, `write(data)` and `close()`.
        interval_s: time between samples [s].
        sleep: waits between polls.
    """

    def __init__(
        self,
        bus: I2cBus,
        interval_s: float = 0.01,
        sleep: Callable[[float], None] = time.sleep,
    ):
        self._bus, self._sleep = bus, sleep
        self._poll_s = interval_s / 5
        self._sequence = 0
        self._gyro: Array | None = None
        for report in (GYROSCOPE, GAME_ROTATION):
            self._switch_on(report, round(1e6 * interval_s))

    def wait(self) -> tuple[Array, Array]:
        """Returns orientation and angular velocity once the next orientation comes.

        Raises:
            TimeoutError: no sample for 0.5 s.
        """
        quat = None
        waited = 0.0
        while quat is None or self._gyro is None:
            for report, values in self._receive():
                if report == GYROSCOPE:
                    self._gyro = values / 2**9
                elif report == GAME_ROTATION:
                    i, j, k, real = values / 2**14
                    quat = np.array((real, i, j, k))
            if quat is None or self._gyro is None:
                if waited > _TIMEOUT_S:
                    raise TimeoutError("no sample of the BNO085 for 0.5 s")
                self._sleep(self._poll_s)
                waited += self._poll_s
        return quat, self._gyro

    def close(self) -> None:
        """Lets go of the bus."""
        self._bus.close()

    def _switch_on(self, report: int, interval_us: int) -> None:
        body = _SET_FEATURE.pack(0xFD, report, 0, 0, interval_us, 0, 0)
        header = _HEADER.pack(_HEADER.size + len(body), _CONTROL, self._sequence)
        self._sequence = (self._sequence + 1) % 256
        self._bus.write(header + body)

    def _receive(self) -> list[tuple[int, Array]]:
        """Reads one cargo, if there is one; returns its reports."""
        length, _, _ = _HEADER.unpack(self._bus.read(_HEADER.size))
        length &= 0x7FFF
        if not _HEADER.size < length <= _LONGEST:
            return []
        cargo = self._bus.read(length)
        _, channel, _ = _HEADER.unpack_from(cargo)
        if channel != _REPORTS:
            return []
        return parse_reports(cargo[_HEADER.size :])


def parse_reports(cargo: bytes) -> list[tuple[int, Array]]:
    """Returns identifier and raw values of each known input report of a cargo.

    A report that is not known ends the cargo: its length is not known either.
    """
    reports, position = [], 0
    while position < len(cargo):
        kind = cargo[position]
        if kind in (_TIME_BASE, _REBASE):
            position += _TIME_BASE_BYTES
            continue
        length = _LENGTHS.get(kind)
        if length is None or position + length > len(cargo):
            break
        values = np.frombuffer(cargo, "<i2", (length - 4) // 2, position + 4)
        reports.append((kind, values.astype(np.float64)))
        position += length
    return reports
