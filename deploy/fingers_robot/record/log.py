"""A log as named columns, for identification and for replay."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingers_deploy.errors import InputError
from fingers_robot.record.mcap_read import read_mcap
from fingers_robot.record.row import (
    CDR_HEADER,
    ROW,
    SCHEMA_NAME,
    SCHEMA_VERSION,
    TOPIC,
)

EVENTS_TOPIC = "/fingers/events"
METADATA, SUMMARY = "fingers_log", "fingers_summary"
PER_JOINT = ("cmd", "pos", "cur", "temp")
_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Log:
    """One recorded run.

    Attributes:
        source: the file.
        joint_names: the joints, in the order of every joint vector.
        rows: the rows, [n] of `record.row.ROW`.
        events: time since the start [s] and text of each event.
        metadata: what was recorded about the run.
        complete: the file was closed; false after a crash.
        summary: timing of the whole run, in the last file of a run that has ended.
    """

    source: str
    joint_names: tuple[str, ...]
    rows: NDArray[np.void]
    events: tuple[tuple[float, str], ...]
    metadata: dict[str, str]
    complete: bool
    summary: dict[str, str] = field(default_factory=dict)

    def columns(self) -> dict[str, NDArray]:
        """Columns `t`, `cmd.<joint>`, `pos.<joint>`, `cur.<joint>`, `gyro.x`, ….

        Angles in rad, effort in A, temperature in °C, `gyro` in rad/s, `supply` in V;
        every other field of the row under its own name.
        """
        table: dict[str, NDArray] = {}
        for name in ROW.names or ():
            values = self.rows[name]
            if name in PER_JOINT:
                table |= {
                    f"{name}.{joint}": values[:, i]
                    for i, joint in enumerate(self.joint_names)
                }
            elif name in ("gravity", "gyro"):
                table |= {f"{name}.{a}": values[:, i] for i, a in enumerate(_AXES)}
            elif values.ndim == 2:
                table |= {f"{name}.{i}": values[:, i] for i in range(values.shape[1])}
            else:
                table[name] = values
        return table


def read_log(path: str | Path) -> Log:
    """Reads a log that `fingers-deploy run` or `record` wrote.

    Raises:
        InputError: not such a log, of another schema version, or damaged.
    """
    found = read_mcap(path)
    metadata = found.metadata.get(METADATA)
    if metadata is None or TOPIC not in found.messages:
        raise InputError(path, "metadata", "none of this package", METADATA)
    version = metadata.get("schema_version")
    if version != str(SCHEMA_VERSION):
        raise InputError(path, "schema_version", version, f"{SCHEMA_VERSION}")
    if SCHEMA_NAME not in found.schemas.values():
        raise InputError(path, "schema", sorted(found.schemas.values()), SCHEMA_NAME)
    joints = tuple(metadata.get("joints", "").split(","))
    events = tuple(
        (time_ns * 1e-9, _string(data, path))
        for time_ns, data in found.messages.get(EVENTS_TOPIC, [])
    )
    start = _start(metadata.get("start_unix_s", "0"), path)
    rows = _rows([data for _, data in found.messages[TOPIC]], path)
    return Log(
        source=str(path),
        joint_names=joints,
        rows=rows,
        events=tuple((when - start, line) for when, line in events),
        metadata=metadata,
        complete=found.complete,
        summary=found.metadata.get(SUMMARY, {}),
    )


def _start(text: str, path: str | Path) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise InputError(path, "start_unix_s", text, "a time [s]") from error


def encode_string(line: str) -> bytes:
    """CDR encoding of one string."""
    data = line.encode("utf-8") + b"\0"
    return CDR_HEADER + len(data).to_bytes(4, "little") + data


def _string(data: bytes, path: str | Path) -> str:
    try:
        return data[len(CDR_HEADER) + 4 : -1].decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(path, EVENTS_TOPIC, "no text", "UTF-8") from error


def _rows(messages: list[bytes], path: str | Path) -> NDArray[np.void]:
    size = len(CDR_HEADER) + ROW.itemsize
    for data in messages:
        if len(data) != size or data[: len(CDR_HEADER)] != CDR_HEADER:
            raise InputError(path, TOPIC, f"{len(data)} bytes", f"{size} per row")
    return np.frombuffer(b"".join(d[len(CDR_HEADER) :] for d in messages), ROW)
