"""Drivers that other installed packages bring."""

from collections.abc import Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from fingers_deploy.errors import InputError
from fingers_deploy.manifest import Interface
from fingers_robot.drivers.protocol import Driver

GROUP = "fingers.drivers"
"""Entry points: functions of options and interface that return a driver."""


def outside_kinds() -> tuple[str, ...]:
    """Names of the drivers of other packages; none of them is imported."""
    return tuple(sorted({point.name for point in entry_points(group=GROUP)}))


def open_outside(options: Mapping[str, Any], interface: Interface) -> Driver:
    """Opens the driver of another package.

    Args:
        options: as for `open_driver`.
        interface: of the policy.

    Raises:
        InputError: no package or several bring it, or it cannot be imported.
        OSError: the device does not answer.
    """
    return outside_opener(options["kind"])(options, interface)


def outside_opener(kind: str) -> Any:
    """Imports what opens a driver of another package.

    Raises:
        InputError: no package or several bring it, or it cannot be imported.
    """
    points = entry_points(group=GROUP, name=kind)
    found = {(_origin(point), point.value): point for point in points}
    if len(found) != 1:
        both = " and ".join(name for name, _ in found)
        valid = "one package that brings it"
        raise InputError(f"--driver {kind}", "", both, valid)
    (point,) = found.values()
    try:
        return point.load()
    except (Exception, SystemExit) as error:
        what = f"{type(error).__name__}: {error}"
        place = f"package {_origin(point)}"
        raise InputError(place, f"driver {kind}", what, "one that imports") from error


def _origin(point: EntryPoint) -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist else "unknown"
