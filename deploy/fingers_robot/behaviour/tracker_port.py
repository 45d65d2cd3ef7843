"""Where a camera's samples come in: a local datagram socket, one sample per message.

A message is a JSON object with the fields of `tracking.Frame` and the target:

    {"t_s": 12.016, "object_pos_w": [x, y, z], "root_pos_w": [x, y, z],
     "heading_rad": h, "target_pos_w": [x, y, z]}
"""

import json
import math
import os
import socket
import stat
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingers_deploy.errors import InputError
from fingers_robot.behaviour.tracking import Frame, ObjectTracker

_LONGEST = 4096
_FIELDS = {
    "t_s": 1,
    "object_pos_w": 3,
    "root_pos_w": 3,
    "heading_rad": 1,
    "target_pos_w": 3,
}
_MAX_M, _LOST_S = 100.0, 1.0


class TrackerPort:
    """Takes samples from the socket and turns them into a policy's inputs.

    A message that is no sample counts for nothing, so that the inputs grow old.

    Args:
        path: of the socket, which is made here.
        v_quat_b: orientation of V in the palm frame, from the manifest.

    Raises:
        InputError: the socket cannot be made.
    """

    def __init__(self, path: str | Path, v_quat_b: ArrayLike):
        self._path, self._v_quat_b = str(path), v_quat_b
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            if stat.S_ISSOCK(os.stat(path).st_mode):
                os.unlink(path)  # of a run that was killed
        except OSError:
            pass  # nothing is there, or what is there makes the next call fail
        try:
            self._socket.bind(self._path)
            os.chmod(path, 0o660)
        except OSError as error:
            found = error.strerror or str(error)
            raise InputError(path, "", found, "a place for a socket") from error
        self.problem = ""
        self._tracker: ObjectTracker | None = None
        self._newest_s = self._arrived_s = -math.inf

    def poll(self, t: float) -> float:
        """Takes the samples that have come; returns the age of the newest [s]."""
        while True:
            try:
                data = self._socket.recv(_LONGEST)
            except BlockingIOError:
                return t - self._arrived_s
            try:
                self._take(read_sample(data), t)
            except InputError as error:
                self.problem = self.problem or str(error)

    def inputs(self, gravity_b: ArrayLike) -> NDArray[np.float32]:
        """As `ObjectTracker.inputs`, [9]; zeros before the first sample."""
        if self._tracker is None:
            return np.zeros(9, np.float32)
        return self._tracker.inputs(gravity_b)

    def close(self) -> None:
        """Lets go of the socket."""
        self._socket.close()
        Path(self._path).unlink(missing_ok=True)

    def _take(self, sample: dict[str, Any], t: float) -> None:
        target = sample.pop("target_pos_w")
        frame = Frame(**sample)
        lost = t - self._arrived_s > _LOST_S
        # Exposures must go on: a camera that repeats itself grows old, and only then
        # may its clock begin anew.
        if frame.t_s <= self._newest_s and not lost:
            return
        if self._tracker is None or lost:
            self._tracker = ObjectTracker(target, self._v_quat_b)
        self._tracker.aim(target)
        self._tracker.update(frame)
        self._newest_s, self._arrived_s = frame.t_s, t


def read_sample(data: bytes) -> dict[str, Any]:
    """Reads one message.

    Raises:
        InputError: it is no sample.
    """
    try:
        table = json.loads(data.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise InputError("tracker", "", error, "a JSON object") from error
    if not isinstance(table, dict) or set(table) != set(_FIELDS):
        found = ", ".join(map(str, table)) if isinstance(table, dict) else table
        raise InputError("tracker", "", found, ", ".join(_FIELDS))
    for name, size in _FIELDS.items():
        values = [table[name]] if size == 1 else table[name]
        if not isinstance(values, list) or not _numbers(values, size, name):
            valid = f"{size} finite number{'s' * (size > 1)}"
            if name.endswith("_w"):
                valid += f" [m] up to {_MAX_M:g}"
            raise InputError("tracker", name, table[name], valid)
    return table


def _numbers(values: list, size: int, name: str) -> bool:
    most = _MAX_M if name.endswith("_w") else 1e12
    return len(values) == size and all(
        type(value) in (int, float) and abs(value) <= most  # False for NaN
        for value in values
    )
