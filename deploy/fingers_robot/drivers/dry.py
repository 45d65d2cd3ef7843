"""A dry run: everything is read, nothing is energized or moved."""

import dataclasses

from fingers_robot.drivers.protocol import Driver
from fingers_robot.reading import Array, DriverInfo, Health, ImuReading, Reading


class DryRun:
    """Passes measurements on, swallows targets, and only pretends to energize.

    Args:
        driver: the driver that is really there.
    """

    def __init__(self, driver: Driver):
        self._driver = driver
        self._pretends = False

    @property
    def info(self) -> DriverInfo:
        """As the driver's."""
        info = self._driver.info
        return dataclasses.replace(info, name=f"{info.name} (dry run)")

    @property
    def over(self) -> bool:
        """As the driver's."""
        return self._driver.over

    def read(self) -> Reading | None:
        """As the driver's."""
        return self._driver.read()

    def imu(self) -> ImuReading | None:
        """As the driver's."""
        return self._driver.imu()

    def health(self) -> Health | None:
        """As the driver's, but for whether the joints are energized."""
        health = self._driver.health()
        if health is None:
            return None
        on = self._pretends
        return dataclasses.replace(health, enabled=on, disabled=not on)

    def write(self, target_rad: Array) -> None:
        """Sends nothing."""

    def enable(self) -> None:
        """Pretends."""
        self._pretends = True

    def disable(self) -> None:
        """Stops pretending, and makes sure that the hand is not energized."""
        self._pretends = False
        self._driver.disable()

    def close(self) -> None:
        """Lets go of the hand."""
        self._driver.close()
