"""A Dynamixel XL330 servo that swings a pendulum, 16 records at about 190 Hz.

Source:
    Rhoban, "Better Actuator Models" (BAM), github.com/Rhoban/bam, commit af22604,
    folder bam/data.bak/raw; G. Duclusaud et al., "Extended Friction Models for the
    Physics Simulation of Servo Actuators", arXiv 2410.08650.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from envs.errors import InputError
from sysid.logs.log import Load, MeasuredLog, make_log

PWM_FULL = 885.0
"""Present PWM of the servo at full duty [counts]."""

_COLUMNS = {
    "cmd.servo": "goal_position",
    "pos.servo": "position",
    "vel.servo": "speed",
    "temp.servo": "temp",
    "supply": "input_volts",
}
_VALID = "a record of the XL330 data set (JSON with mass, length, kp and entries)"


def load_xl330(folder: str | Path) -> tuple[MeasuredLog, ...]:
    """Loads all records of a folder in order of time.

    One joint `servo`; `duty` is the servo's present PWM over its full scale, the
    setting `kp` its position gain in the units of its register. Where the torque was
    off, the servo had no target: `cmd` is missing there, and `duty` is 0 or missing as
    the servo reported it.

    Raises:
        InputError: no record in the folder, or a file that is none.
    """
    files = sorted(Path(folder).glob("*.json"))
    if not files:
        raise InputError(folder, "", "no .json file", "a folder of XL330 records")
    return tuple(_load(path) for path in files)


def _load(path: Path) -> MeasuredLog:
    """Loads one record."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        entries = record["entries"]
        t_s = _numbers(entries, "timestamp")
        columns = {ours: _numbers(entries, theirs) for ours, theirs in _COLUMNS.items()}
        columns["duty.servo"] = _signed16(_numbers(entries, "load")) / PWM_FULL
        off = ~np.asarray([entry["torque_enable"] for entry in entries], dtype=bool)
        load = Load(float(record["mass"]), float(record["length"]))
        settings = {"kp": float(record["kp"]), "vin": float(record["vin"])}
        note = f"trajectory {record['trajectory']}"
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(path, "", repr(error), _VALID) from error
    columns["cmd.servo"] = np.where(off, np.nan, columns["cmd.servo"])
    return make_log(
        ("servo",),
        t_s,
        columns,
        load=load,
        settings=settings,
        note=note,
        source=str(path),
    )


def _numbers(entries: list[dict[str, Any]], name: str) -> np.ndarray:
    """Returns one field of all entries."""
    return np.asarray([float(entry[name]) for entry in entries])


def _signed16(counts: np.ndarray) -> np.ndarray:
    """Reads 16-bit two's complement counts that were stored without their sign."""
    return np.where(counts >= 1 << 15, counts - (1 << 16), counts)
