"""What a driver does: nothing else moves between the loop and a hand."""

from typing import Protocol

from fingers_robot.reading import Array, DriverInfo, Health, ImuReading, Reading


class Imu(Protocol):
    """An IMU on the back of the hand."""

    def read(self) -> ImuReading | None:
        """Returns the newest sample, None before the first; never blocks."""
        ...

    def close(self) -> None:
        """Lets go of the device."""
        ...


class Driver(Protocol):
    """A hand with its IMU.

    No method blocks for longer than about a millisecond; slow transactions belong into
    a thread of the driver. Whatever goes wrong is raised, never replaced by old or
    invented values. Times are of the clock that the loop uses (`runtime.clock`).
    """

    @property
    def info(self) -> DriverInfo:
        """What does not change while the driver is open."""
        ...

    @property
    def over(self) -> bool:
        """Nothing more will come: a recording that has ended, never a hand."""
        ...

    def read(self) -> Reading | None:
        """Returns the newest sample of the joints; None before the first."""
        ...

    def imu(self) -> ImuReading | None:
        """Returns the newest sample of the IMU; None before the first."""
        ...

    def health(self) -> Health | None:
        """Returns the newest slow read-back; None before the first."""
        ...

    def write(self, target_rad: Array) -> None:
        """Sends joint targets [rad], [20]; the hand follows them while energized."""
        ...

    def enable(self) -> None:
        """Asks for power; `health().enabled` says when the hand confirmed it."""
        ...

    def disable(self) -> None:
        """Asks for power off; `health().disabled` says when the hand confirmed it."""
        ...

    def close(self) -> None:
        """De-energizes the hand and lets go of it; may be called twice."""
        ...
