"""Recording in a thread: a full disk or a slow card never delays the loop."""

import os
import queue
import threading
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fingers_deploy.errors import InputError
from fingers_robot.record.log import EVENTS_TOPIC, METADATA, SUMMARY, encode_string
from fingers_robot.record.mcap_write import McapWriter
from fingers_robot.record.ros import (
    COMMANDS_TOPIC,
    IMU,
    IMU_TEXT,
    IMU_TOPIC,
    JOINT_STATE,
    JOINT_STATE_TEXT,
    STATES_TOPIC,
    JointStates,
    encode_imu,
)
from fingers_robot.record.row import (
    CDR_HEADER,
    ROW,
    SCHEMA_NAME,
    SCHEMA_VERSION,
    TOPIC,
    schema_text,
)

MAX_FILE_BYTES = 49_000_000  # what is still to be written then makes it no 50 MB
_MAX_WAITING = 5000
_FLUSH_S = 1.0
_STRING = "string data\n"


class Recorder:
    """Writes rows and events to `<stem>-000.mcap`, `<stem>-001.mcap`, ….

    A new file begins before 50 MB (10⁶ bytes) are reached. Rows that the disk cannot
    take in time, or at all, are dropped and counted: the loop goes on.

    Args:
        folder: an existing folder.
        stem: beginning of the file names.
        joint_names: the joints.
        metadata: what to record about the run.
        start_s: monotonic time of the start of the run [s].

    Raises:
        InputError: the first file cannot be created.
    """

    def __init__(
        self,
        folder: str | Path,
        stem: str,
        joint_names: tuple[str, ...],
        metadata: Mapping[str, str],
        start_s: float,
    ):
        self._base = Path(folder) / stem
        self._start_s, self._start_unix_s = start_s, time.time()
        self._metadata = {
            "schema_version": str(SCHEMA_VERSION),
            "joints": ",".join(joint_names),
            "units": "rad A degC rad/s V s",
            "start_unix_s": repr(self._start_unix_s),
            **metadata,
        }
        self._joint_states = JointStates(joint_names)
        self.files: list[Path] = []
        self.dropped = 0
        self.error = ""
        self._queue: queue.SimpleQueue[tuple[int, float, bytes] | None] = (
            queue.SimpleQueue()
        )
        self._writer = self._open()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def row(self, t_s: float, row: np.ndarray) -> None:
        """Records a row; returns at once. `t_s` is monotonic time [s]."""
        self._put(self._rows, t_s, CDR_HEADER + row.tobytes())

    def event(self, t_s: float, line: str) -> None:
        """Records an event; returns at once."""
        self._put(self._events, t_s, encode_string(line))

    def close(self, summary: Mapping[str, str] | None = None) -> None:
        """Writes what still waits and closes the file."""
        self._summary = dict(summary or {}) | {"dropped_rows": str(self.dropped)}
        self._queue.put(None)
        self._thread.join(timeout=10.0)

    def _put(self, channel: int, t_s: float, data: bytes) -> None:
        if self.error or self._queue.qsize() > _MAX_WAITING:
            self.dropped += 1
            return
        self._queue.put((channel, t_s, data))

    def _open(self) -> McapWriter:
        path = self._base.with_name(f"{self._base.name}-{len(self.files):03d}.mcap")
        try:
            # Exclusive: a log is never written over.
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        except OSError as error:
            raise InputError(path, "", error.strerror, "a new file") from error
        self.files.append(path)
        writer = McapWriter(os.fdopen(handle, "wb"), "ros2", "fingers-deploy")
        self._rows = writer.add_channel(TOPIC, SCHEMA_NAME, schema_text())
        self._events = writer.add_channel(EVENTS_TOPIC, "std_msgs/msg/String", _STRING)
        self._commands = writer.add_channel(
            COMMANDS_TOPIC, JOINT_STATE, JOINT_STATE_TEXT
        )
        self._states = writer.add_channel(STATES_TOPIC, JOINT_STATE, JOINT_STATE_TEXT)
        self._imu = writer.add_channel(IMU_TOPIC, IMU, IMU_TEXT)
        writer.add_metadata(METADATA, self._metadata)
        return writer

    def _add(self, channel: int, time_ns: int, data: bytes) -> None:
        """Adds a message; a row also in the words of ROS 2, without gaps filled."""
        self._writer.add_message(channel, time_ns, data)
        if channel != self._rows:
            return
        row = np.frombuffer(data, ROW, offset=len(CDR_HEADER))[0]
        command = self._joint_states.encode(time_ns, row["cmd"])
        self._writer.add_message(self._commands, time_ns, command)
        if np.isfinite(row["pos"]).all():
            state = self._joint_states.encode(time_ns, row["pos"], row["cur"])
            self._writer.add_message(self._states, time_ns, state)
        if np.isfinite(row["quat"]).all():
            imu = encode_imu(time_ns, row["quat"], row["gyro"])
            self._writer.add_message(self._imu, time_ns, imu)

    def _run(self) -> None:
        try:
            self._write_all()
        except (OSError, InputError) as error:
            self.error = str(error)

    def _write_all(self) -> None:
        flushed = time.monotonic()
        while (item := self._queue.get()) is not None:
            channel, t_s, data = item
            unix_s = self._start_unix_s + (t_s - self._start_s)
            self._add(channel, round(unix_s * 1e9), data)
            if time.monotonic() - flushed > _FLUSH_S:
                self._writer.flush()
                flushed = time.monotonic()
            if self._writer.size > MAX_FILE_BYTES:
                self._writer.close()
                self._writer = self._open()
        self._writer.flush()
        self._writer.add_metadata(SUMMARY, self._summary)
        self._writer.close()
