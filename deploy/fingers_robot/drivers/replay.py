"""A recorded log in the place of a hand: measurements come from it, targets go nowhere.

It serves to look at what a policy would have done, and to test everything behind the
driver on real measurements. Nothing follows the targets, so it is always a dry run.
"""

import bisect
from collections.abc import Callable

import numpy as np

from fingers_deploy.errors import InputError
from fingers_deploy.manifest import Interface
from fingers_robot.drivers.stand_in import info_of, sound_health
from fingers_robot.reading import Array, Health, ImuReading, Reading
from fingers_robot.record.log import Log


class ReplayDriver:
    """Plays a log at its own pace.

    Args:
        log: the log.
        interface: of the policy; the log must have its joints.
        clock: monotonic time [s]; the log begins when the driver is made.

    Raises:
        InputError: no rows, or other joints.
    """

    def __init__(self, log: Log, interface: Interface, clock: Callable[[], float]):
        if log.joint_names != interface.joint_names:
            valid = "the joints of the policy"
            raise InputError(log.source, "joints", log.joint_names, valid)
        if not len(log.rows):
            raise InputError(log.source, "", "no rows", "at least one")
        self._log, self._clock = log, clock
        self._times = (log.rows["t"] - log.rows["t"][0]).tolist()
        self._start_s = clock()
        self._enabled = False
        self.info = info_of(interface, f"replay of {log.source}", live=False)

    @property
    def over(self) -> bool:
        """The log has ended."""
        return self._clock() - self._start_s > self._times[-1]

    def read(self) -> Reading:
        """The newest row; too old where the log has a gap or is over."""
        row, t_s = self._row()
        pos, effort = (row[name].astype(np.float64) for name in ("pos", "cur"))
        return Reading(t_s, pos, effort)

    def imu(self) -> ImuReading:
        """As `read`."""
        row, t_s = self._row()
        quat, gyro = (row[name].astype(np.float64) for name in ("quat", "gyro"))
        return ImuReading(t_s, quat, gyro)

    def health(self) -> Health:
        """Temperatures and supply of the newest row; the rest as it should be."""
        row, t_s = self._row()
        pos, temperature = (row[name].astype(np.float64) for name in ("pos", "temp"))
        supply_v = float(row["supply"])
        return sound_health(t_s, self._enabled, pos, temperature, supply_v)

    def write(self, target_rad: Array) -> None:
        """Goes nowhere."""

    def enable(self) -> None:
        """Pretends."""
        self._enabled = True

    def disable(self) -> None:
        """Pretends."""
        self._enabled = False

    def close(self) -> None:
        """Nothing to let go of."""

    def _row(self) -> tuple[np.void, float]:
        elapsed = self._clock() - self._start_s
        index = max(bisect.bisect_right(self._times, elapsed) - 1, 0)
        return self._log.rows[index], self._start_s + self._times[index]
