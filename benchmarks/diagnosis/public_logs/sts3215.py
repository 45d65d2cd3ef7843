"""Feetech STS3215 and STS3250 servos under alternating pulls, about 10 Hz.

Source:
    D. Kotov, Robonine, github.com/roboninecom/Backlash-Compensation-in-STS3215-Servo-
    Actuators, folder logs; Zenodo 10.5281/zenodo.17903002.
"""

import csv
import re
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import numpy as np

from envs.errors import InputError, one_of
from sysid.logs.log import MeasuredLog, make_log

COUNTS_PER_TURN = 4096
RAD_PER_COUNT = 2.0 * np.pi / COUNTS_PER_TURN
HOME_COUNT = 2047
"""Count that is 0 rad here, the middle of the servo's turn."""

AMPERE_PER_COUNT = 0.0065
"""Step of the current register (Feetech, STS3215 memory table)."""

DUTY_PER_COUNT = 0.001
"""Step of the load register, the share of the supply (same source)."""

_LOAD_SIGN, _SPEED_SIGN = 1 << 10, 1 << 15
_VALID = "a telemetry file of the STS3215 data set"


def load_sts3215(path: str | Path, motors: Sequence[str] = ()) -> MeasuredLog:
    """Loads one telemetry file.

    Joints are named `motor1`, `motor2`, … as in the file; motors without a reading are
    left out. The servo reports the size of its current only, so `cur` is ≥ 0. A load
    whose sign bit is set turns the servo towards larger counts, as the records show:
    `duty` is positive then.

    Args:
        path: the file.
        motors: numbers of the motors that are wanted; all of them if there are none.

    Raises:
        InputError: not such a file, or not such a motor; names the line.
    """
    file = Path(path)
    names, rows = _read(file)
    t_s = _seconds(file, [row[0] for row in rows])
    cells = np.array([[_number(file, i, x) for x in r[1:]] for i, r in enumerate(rows)])
    table = dict(zip(names[1:], cells.T, strict=True))
    with_pos = [m for name in names if (m := re.fullmatch(r"pos \((\d+)\)", name))]
    found = [m[1] for m in with_pos if not np.all(np.isnan(table[m[0]]))]
    if not found:
        raise InputError(file, "columns", ", ".join(names), _VALID)
    for motor in motors:
        if motor not in found:
            raise InputError(file, "motors", motor, one_of(found, motor))
    try:
        wanted = tuple(motors) or tuple(found)
        columns = {k: v for m in wanted for k, v in _motor(table, m).items()}
    except KeyError as error:
        raise InputError(file, "columns", f"no {error.args[0]}", _VALID) from error
    joints = tuple(f"motor{motor}" for motor in wanted)
    return make_log(joints, t_s, columns, source=str(file))


def _motor(table: dict[str, np.ndarray], motor: str) -> dict[str, np.ndarray]:
    """Returns the columns of one motor in SI units."""

    def raw(name: str) -> np.ndarray:
        return table[f"{name} ({motor})"]

    columns = {
        "cmd": (raw("target pos") - HOME_COUNT) * RAD_PER_COUNT,
        "pos": (raw("pos") - HOME_COUNT) * RAD_PER_COUNT,
        "vel": _signed(raw("speed"), _SPEED_SIGN) * RAD_PER_COUNT,
        "duty": -_signed(raw("load"), _LOAD_SIGN) * DUTY_PER_COUNT,
        "cur": raw("current") * AMPERE_PER_COUNT,
        "temp": raw("temp"),
    }
    return {f"{name}.motor{motor}": values for name, values in columns.items()}


def _signed(counts: np.ndarray, sign_bit: int) -> np.ndarray:
    """Reads counts whose sign is one bit above their size."""
    return np.where(counts >= sign_bit, sign_bit - counts, counts)


def _read(path: Path) -> tuple[list[str], list[list[str]]]:
    """Reads the column names and all rows as text."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as stream:
            names, *rows = list(csv.reader(stream)) or [[]]
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(path, "", error, _VALID) from error
    if names[:1] != ["timestamp"] or not rows:
        raise InputError(path, "columns", ", ".join(names), _VALID)
    for index, row in enumerate(rows):
        if len(row) != len(names):
            found, valid = f"{len(row)} cells", f"{len(names)} cells"
            raise InputError(path, f"line {index + 2}", found, valid)
    return names, rows


def _number(path: Path, index: int, cell: str) -> float:
    """Reads one cell; an empty one is a missing reading."""
    try:
        return float(cell) if cell else np.nan
    except ValueError:
        raise InputError(path, f"line {index + 2}", cell, "a number") from None


def _seconds(path: Path, stamps: list[str]) -> np.ndarray:
    """Returns seconds since the first of the ISO 8601 time stamps."""
    try:
        times = [datetime.fromisoformat(stamp) for stamp in stamps]
        return np.array([(time - times[0]).total_seconds() for time in times])
    except (TypeError, ValueError) as error:
        raise InputError(path, "timestamp", error, "ISO 8601 times") from error
