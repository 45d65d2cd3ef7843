"""Opening a driver from plain options, in whichever process needs it."""

import time
from collections.abc import Mapping
from typing import Any

from fingers_deploy.errors import InputError
from fingers_deploy.manifest import Interface
from fingers_robot.drivers.bno085 import Bno085, I2cBus
from fingers_robot.drivers.dry import DryRun
from fingers_robot.drivers.imu_port import ImuPort, NoImu
from fingers_robot.drivers.outside import open_outside, outside_opener
from fingers_robot.drivers.protocol import Driver, Imu
from fingers_robot.drivers.replay import ReplayDriver
from fingers_robot.drivers.sim import SimDriver
from fingers_robot.drivers.wuji import WujiDriver
from fingers_robot.record.log import read_log

KINDS = ("sim", "replay", "wuji")
"""Drivers of this package; others bring theirs, see `fingers_robot.drivers.outside`."""


def open_driver(options: Mapping[str, Any], interface: Interface) -> Driver:
    """Opens the driver that `options["kind"]` names.

    Args:
        options: of `sim`: `socket`; of `replay`: `log`; of `wuji`: `side`, `serial`,
            `imu_bus`, `imu_address`, `imu_mount`, `without_imu` (the guard may not need
            what has perhaps failed). Of all: `dry_run`. A driver of another package
            has `device`, and the others.
        interface: of the policy.

    Raises:
        InputError: the device or file is missing or does not fit the policy.
        OSError: the device does not answer.
    """
    opened = _OPENERS.get(options["kind"], open_outside)
    driver = opened(options, interface)
    return DryRun(driver) if options.get("dry_run") else driver


def prepare_driver(options: Mapping[str, Any]) -> None:
    """Imports what opening a driver takes, so that it will open at once.

    Raises:
        InputError: the library is missing, or the package that brings the driver is
            broken.
    """
    if options["kind"] == "wuji":
        _library()
    elif options["kind"] not in _OPENERS:
        outside_opener(options["kind"])


def _library() -> Any:
    try:
        import wujihandpy  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        valid = "pip install wujihandpy, or the extra [hand]"
        raise InputError("driver", "wuji", "no wujihandpy", valid) from error
    return wujihandpy


def _sim(options: Mapping[str, Any], interface: Interface) -> Driver:
    return SimDriver(options["socket"], interface)


def _replay(options: Mapping[str, Any], interface: Interface) -> Driver:
    return ReplayDriver(read_log(options["log"]), interface, time.monotonic)


def _wuji(options: Mapping[str, Any], interface: Interface) -> Driver:
    library = _library()
    imu: Imu = NoImu()
    if not options.get("without_imu"):
        bus = I2cBus(options["imu_bus"], options["imu_address"])
        imu = ImuPort(Bno085(bus), tuple(options["imu_mount"]))
    try:
        return WujiDriver(
            library, interface, imu, options["side"], options.get("serial")
        )
    except BaseException:
        imu.close()
        raise


_OPENERS = {"sim": _sim, "replay": _replay, "wuji": _wuji}
