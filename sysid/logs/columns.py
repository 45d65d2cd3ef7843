"""Columns of a measured log: which names exist, what they mean, in which units."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from envs.errors import InputError, one_of

MAX_CELLS, MAX_COLUMNS = 25_000_000, 1000
"""Of a log: twenty minutes of 40 columns at 500 Hz, in 200 MB."""
FINGERS = ("thumb", "index", "middle", "ring", "little")


@dataclass(frozen=True)
class Quantity:
    """What one family of columns measures.

    Attributes:
        per: `joint` for columns `<quantity>.<joint>`, `finger`, `axis` (named parts)
            or `log` (one column of the quantity's own name).
        units: units it may have; the first is the usual one.
        parts: names of the parts when `per` is `axis`.
        limit: largest believable magnitude, by unit.
    """

    per: str
    units: tuple[str, ...]
    parts: tuple[str, ...] = ()
    limit: Mapping[str, float] | None = None


_ANGLE = {"rad": 4.0 * math.pi, "m": 100.0}
_XYZ = ("x", "y", "z")

QUANTITIES: Mapping[str, Quantity] = {
    "cmd": Quantity("joint", ("rad", "m"), limit=_ANGLE),
    "pos": Quantity("joint", ("rad", "m"), limit=_ANGLE),
    "vel": Quantity("joint", ("rad/s", "m/s")),
    "cur": Quantity("joint", ("A",)),
    "tau": Quantity("joint", ("N·m", "N")),
    "duty": Quantity("joint", ("1",), limit={"1": 1.5}),
    "ext": Quantity("joint", ("N·m", "N", "V")),
    "temp": Quantity("joint", ("°C",), limit={"°C": 300.0}),
    "gravity": Quantity("axis", ("1",), _XYZ, {"1": 2.0}),
    "gyro": Quantity("axis", ("rad/s",), _XYZ),
    "base": Quantity("axis", ("m",), (*_XYZ, "qw", "qx", "qy", "qz")),
    "force": Quantity("finger", ("N",)),
    "supply": Quantity("log", ("V",)),
}
"""`cmd` target, `pos` measured position, `vel` speed, `cur` current, `tau` effort of
the drive, `duty` share of the supply that the drive applies (-1 to 1), `ext` known push
from outside, `temp` temperature of the motor, `gravity` unit vector in the palm frame,
`gyro` in the palm frame, `base` pose of the palm in the world (quaternion without
unit), `force` load cell under a fingertip, `supply` bus voltage."""

_ALIASES = {"N*m": "N·m", "Nm": "N·m", "degC": "°C", "C": "°C"}


def quantity_of(column: str) -> str:
    """Returns the quantity of a column, the part before the first dot."""
    return column.partition(".")[0]


def columns_of(quantity: str, joints: Iterable[str]) -> tuple[str, ...]:
    """Returns all columns that a quantity may have in a log of these joints."""
    kind = QUANTITIES[quantity]
    parts = {"joint": tuple(joints), "finger": FINGERS, "axis": kind.parts}
    if kind.per == "log":
        return (quantity,)
    return tuple(f"{quantity}.{part}" for part in parts[kind.per])


def check_columns(
    source: object, found: Iterable[str], joints: tuple[str, ...]
) -> None:
    """Checks that the columns exist and that every joint has target and position.

    Raises:
        InputError: unknown column, or a joint without `cmd` or `pos`.
    """
    valid = [c for quantity in QUANTITIES for c in columns_of(quantity, joints)]
    names = list(found)
    for name in names:
        if name not in valid:
            raise InputError(source, "columns", name, one_of(valid, name))
    for joint in joints:
        for quantity in ("cmd", "pos"):
            if f"{quantity}.{joint}" not in names:
                needed = f"columns cmd.{joint} and pos.{joint}"
                raise InputError(source, "columns", f"no {quantity}.{joint}", needed)


def standard_units(columns: Iterable[str]) -> dict[str, str]:
    """Returns the usual unit of every quantity among the columns."""
    present = {quantity_of(column) for column in columns}
    return {name: kind.units[0] for name, kind in QUANTITIES.items() if name in present}


def checked_units(
    source: object, units: Mapping[str, str], columns: Iterable[str]
) -> dict[str, str]:
    """Returns the units of the quantities present, in their one spelling.

    Raises:
        InputError: a unit that the quantity cannot have (nothing is converted), a
            quantity without unit, or one that has no column.
    """
    present = standard_units(columns)
    for name in units:
        if name not in present:
            raise InputError(source, f"units.{name}", name, one_of(present, name))
    found = {name: _ALIASES.get(unit, unit) for name, unit in units.items()}
    for name in present:
        valid = QUANTITIES[name].units
        if found.get(name) not in valid:
            expected = f"{' or '.join(valid)}; other units must be converted first"
            raise InputError(source, f"units.{name}", found.get(name, ""), expected)
    return found
