"""Measured logs: the targets and readings of a hand, or any position-controlled joint.

A log keeps what was recorded, as it was recorded. A reading that is missing is NaN in
its row; rows stand in the order of the recording at their own times; gaps, repeated and
backward times stay, and `MeasuredLog.timing` reports them. Nothing is filled in,
sorted, or converted.
"""

import dataclasses
import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from envs.config.typed import to_dict
from envs.errors import InputError, one_of
from sysid.logs.columns import (
    QUANTITIES,
    check_columns,
    checked_units,
    quantity_of,
    standard_units,
)
from sysid.logs.timing import Timing, timing

SCHEMA = 1


@dataclass(frozen=True)
class Load:
    """What hangs on the last joint: a mass [kg] at a distance from its axis [m]."""

    mass_kg: float = field(default=0.0, metadata={"low": 0.0, "high": 1000.0})
    lever_m: float = field(default=0.0, metadata={"low": 0.0, "high": 10.0})


@dataclass(frozen=True)
class LogHeader:
    """What the columns of a log do not say.

    Attributes:
        schema: version of the format.
        joints: names of the joints, in order.
        units: unit of every quantity that has columns, e.g. `{"pos": "rad"}`.
        mounting: `palm_fixed` to a stand, or `free`.
        palm_quat_w: orientation of a fixed palm in the world (w, x, y, z).
        load: what the joints carry.
        settings: parameters of the controller during the record, e.g. `{"kp": 200}`.
        note: free text, e.g. where the record comes from.
    """

    joints: tuple[str, ...]
    units: dict[str, str]
    schema: int = SCHEMA
    mounting: Literal["palm_fixed", "free"] = "palm_fixed"
    palm_quat_w: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    load: Load = field(default_factory=Load)
    settings: dict[str, float] = field(default_factory=dict)
    note: str = ""

    def __post_init__(self) -> None:
        if self.schema != SCHEMA:
            raise InputError("log", "schema", self.schema, f"{SCHEMA}")
        if not self.joints or len(set(self.joints)) < len(self.joints):
            valid = "at least one name, none twice"
            raise InputError("log", "joints", list(self.joints), valid)
        if abs(math.hypot(*self.palm_quat_w) - 1.0) > 1e-3:
            valid = "a unit quaternion (w, x, y, z)"
            raise InputError("log", "palm_quat_w", list(self.palm_quat_w), valid)


@dataclass(frozen=True, eq=False)
class MeasuredLog:
    """One record; see the module for what it keeps.

    Attributes:
        header: joints, units, mounting, load.
        t_s: time of every row [s], in recorded order.
        columns: readings by column name, NaN where there was none in a row.
        key: name of the key event of a row, "" where there was none.
        source: file that the log came from, for messages.
    """

    header: LogHeader
    t_s: Float[np.ndarray, " n"]
    columns: Mapping[str, Float[np.ndarray, " n"]]
    key: np.ndarray | None = None
    source: str = "log"
    _timings: dict[str, Timing] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        check_columns(self.source, self.columns, self.header.joints)
        units = checked_units(self.source, self.header.units, self.columns)
        object.__setattr__(
            self, "header", dataclasses.replace(self.header, units=units)
        )
        object.__setattr__(self, "t_s", _checked_times(self.source, self.t_s))
        columns = {name: self._checked(name) for name in sorted(self.columns)}
        object.__setattr__(self, "columns", columns)
        if self.key is not None:
            _check_length(self.source, "key", self.key, len(self.t_s))

    def _checked(self, name: str) -> Float[np.ndarray, " n"]:
        """Returns a column as a read-only array, or refuses it."""
        values = _read_only(self.source, name, self.columns[name])
        _check_length(self.source, name, values, len(self.t_s))
        if np.any(np.isinf(values)):
            raise InputError(self.source, name, "infinity", "finite numbers")
        if np.all(np.isnan(values)):
            raise InputError(self.source, name, "no reading", "a column with readings")
        self._check_size(name, values)
        return values

    def _check_size(self, name: str, values: np.ndarray) -> None:
        """Refuses magnitudes that only a wrong unit explains."""
        quantity = quantity_of(name)
        unit = self.header.units[quantity]
        limit = (QUANTITIES[quantity].limit or {}).get(unit, np.inf)
        if (largest := np.nanmax(np.abs(values))) > limit:
            valid = f"at most {limit:.4g} {unit} (are the values in {unit}?)"
            raise InputError(self.source, name, f"{largest:.4g}", valid)

    def __len__(self) -> int:
        return len(self.t_s)

    def column(self, name: str) -> Float[np.ndarray, " n"]:
        """y_t of one column, t = 1 … n, NaN where there was no reading.

        Args:
            name: of the column; its unit is in the header [rad, N·m, A, …].

        Raises:
            InputError: the log does not have it.

        Source:
            The record itself.
        """
        if name not in self.columns:
            raise InputError(self.source, "columns", name, one_of(self.columns, name))
        return self.columns[name]

    def missing(self, name: str) -> Bool[np.ndarray, " n"]:
        """y_t = NaN: in which rows a column has no reading [1].

        Source:
            The record itself.
        """
        return np.isnan(self.column(name))

    def samples(
        self, name: str
    ) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
        """(t_i, y_i) for all i ∈ {i : y_i ≠ NaN}: times [s] and values of the readings.

        Source:
            The record itself.
        """
        kept = ~self.missing(name)
        return self.t_s[kept], self.column(name)[kept]

    def timing(self, name: str) -> Timing:
        """Describes when one column was read, once; its missing rows are no samples.

        Raises:
            InputError: no such column, or fewer than two readings at different times.
        """
        if name not in self._timings:
            t_s, _ = self.samples(name)
            if len(t_s) < 2:
                found = f"{len(t_s)} reading"
                raise InputError(self.source, name, found, "at least two")
            self._timings[name] = timing(t_s, self.source)
        return self._timings[name]

    def resampled(
        self, name: str, t_s: Float[np.ndarray, " m"]
    ) -> Float[np.ndarray, " m"]:
        """y(t) = (1 − s) y_a + s y_b between neighbours a, b; NaN outside of parts.

        Of several readings at one time the last one counts.

        Args:
            name: column.
            t_s: times to read it at [s].

        Raises:
            InputError: no such column, or times that run backward, where "the value at
                time t" has no meaning.

        Source:
            Textbook linear interpolation, but never across a gap of the record.
        """
        times, values = self.samples(name)
        found = self.timing(name)
        if found.backward.size:
            when = f"a step back at {times[found.backward[0]]:.6g} s"
            raise InputError(self.source, "t", when, "times that never run backward")
        result = np.full(len(t_s), np.nan)
        for part in found.parts:
            last = np.append(np.diff(times[part]) > 0.0, True)
            part_t, part_v = times[part][last], values[part][last]
            inside = (t_s >= part_t[0]) & (t_s <= part_t[-1])
            result[inside] = np.interp(t_s[inside], part_t, part_v)
        return result

    @property
    def sha256(self) -> str:
        """Digest of header, times and readings, whatever file format held them."""
        header = {**to_dict(self.header), "columns": list(self.columns)}
        digest = hashlib.sha256(json.dumps(header, sort_keys=True).encode())
        for values in (self.t_s, *self.columns.values()):
            digest.update(np.where(np.isnan(values), np.nan, values).tobytes())
        if self.key is not None:
            digest.update(json.dumps(self.key.tolist()).encode())
        return digest.hexdigest()


def make_log(
    joints: tuple[str, ...],
    t_s: Float[np.ndarray, " n"],
    columns: Mapping[str, Float[np.ndarray, " n"]],
    units: Mapping[str, str] | None = None,
    **header,
) -> MeasuredLog:
    """Makes a log of columns y_t, t = t_1 … t_n, in the usual units.

    Args:
        joints: names of the joints.
        t_s: time of every row [s].
        columns: arrays by column name.
        units: units that are not the usual ones, by quantity.
        **header: further fields of `LogHeader`; `source` goes to the log.

    Raises:
        InputError: as `MeasuredLog`.

    Source:
        The caller's measurement.

    Examples:
        Half a second of one joint at 10 Hz, whose fourth position was not read:

        >>> t_s = np.arange(6) / 10
        >>> pos = np.array([0.0, 0.1, 0.2, np.nan, 0.4, 0.5])
        >>> log = make_log(("knuckle",), t_s, {"cmd.knuckle": t_s, "pos.knuckle": pos})
        >>> log.header.units
        {'cmd': 'rad', 'pos': 'rad'}
        >>> int(log.missing("pos.knuckle").sum())
        1
        >>> log.resampled("pos.knuckle", np.array([0.15])).round(3)
        array([0.15])
    """
    source = header.pop("source", "log")
    check_columns(source, columns, joints)
    all_units = {**standard_units(columns), **(units or {})}
    return MeasuredLog(
        LogHeader(joints, all_units, **header), t_s, columns, source=source
    )


def _checked_times(source: str, times: np.ndarray) -> Float[np.ndarray, " n"]:
    """Returns the times, refusing what cannot be a time."""
    t_s = _read_only(source, "t", times)
    if len(t_s) < 2:
        raise InputError(source, "t", f"{len(t_s)} rows", "at least two rows")
    bad = ~np.isfinite(t_s)
    if np.any(bad):
        found = f"{t_s[bad][0]} in row {int(np.argmax(bad)) + 1}"
        raise InputError(source, "t", found, "a finite time in every row")
    return t_s


def _read_only(source: str, name: str, values: np.ndarray) -> np.ndarray:
    """Returns a copy as one-dimensional float64 that cannot be written to."""
    array = np.array(values, dtype=float)
    if array.ndim != 1:
        raise InputError(source, name, f"shape {array.shape}", "one number per row")
    array.flags.writeable = False
    return array


def _check_length(source: str, name: str, values: np.ndarray, rows: int) -> None:
    """Refuses a column that is shorter or longer than the times."""
    if len(values) != rows:
        raise InputError(source, name, f"{len(values)} values", f"{rows}, as in t")
