"""Measured logs from ROS 2 bags and MCAP files: joint states, commands, IMU, pose.

Every message becomes a row of its own, in recorded order; columns of other topics are
missing there, so streams of different rates stay what they are. Message types are read
by the definitions of the ROS library, never by those that a file brings along.
"""

from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from envs.errors import InputError, one_of
from fingers_deploy.files import open_regular
from sysid.logs.bag_write import HEADER, KEYS, ROWS, kept_log
from sysid.logs.columns import MAX_CELLS, MAX_COLUMNS, standard_units
from sysid.logs.log import Load, LogHeader, MeasuredLog
from sysid.logs.ros_messages import READERS

MAX_BYTES = 4 << 30
MAX_MESSAGES = 20_000_000
_VALID = "the folder of a ROS 2 bag, or an MCAP file written by ROS 2"


@dataclass(frozen=True)
class BagMap:
    """What a bag does not say, as YAML file: topics, names, and fields of the header.

    Attributes:
        command: topic of the targets (`sensor_msgs/JointState`).
        state: topic of the measured joints (`sensor_msgs/JointState`).
        imu: topic of an IMU (`sensor_msgs/Imu`) in the palm frame; "": none.
        pose: topic of the palm's pose (`geometry_msgs/PoseStamped`); "": none.
        joints: name in the log -> name in the bag; empty: all, as the bag names them.
        effort: what `effort` of the joint states is: torque, current or duty.
        clock: `header` takes the stamps of the messages, `received` those of the bag.
        mounting, palm_quat_w, load, settings, note: as in the header of a log.
    """

    command: str = "/joint_commands"
    state: str = "/joint_states"
    imu: str = ""
    pose: str = ""
    joints: dict[str, str] = field(default_factory=dict)
    effort: Literal["tau", "cur", "duty"] = "tau"
    clock: Literal["header", "received"] = "header"
    mounting: Literal["palm_fixed", "free"] = "palm_fixed"
    palm_quat_w: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    load: Load = field(default_factory=Load)
    settings: dict[str, float] = field(default_factory=dict)
    note: str = ""


OWN_TOPIC = "/fingers/log"
OWN_MAP = BagMap(imu="/imu", effort="cur", mounting="free")
"""Of the recordings of `fingers-deploy`, whose effort is a current."""


def read_bag(path: Path, bag_map: BagMap | None = None) -> MeasuredLog:
    """Reads a log from the folder of a ROS 2 bag or from an MCAP file.

    Args:
        path: the folder or file.
        bag_map: what it does not say; without one `BagMap()`, or for a recording of
            `fingers-deploy`, which is known by its own topic, `OWN_MAP`.

    Raises:
        InputError: not such a file, a topic or joint that it lacks, messages of another
            type, or stamps that are all zero.
        ModuleNotFoundError: rosbags, of the optional dependencies `data`, is missing.
    """
    _check_folder(path)
    if bag_map is None:
        with _opened(path) as reader:
            topics = {connection.topic for connection in reader.connections}
        if HEADER in topics:
            return kept_log(path, _kept(path))
        own = OWN_TOPIC in topics
        bag_map = OWN_MAP if own else BagMap()
    rows = _Rows(path, bag_map)
    for topic, kind, received_ns, message in _messages(path, bag_map):
        rows.add(topic, kind, received_ns, message)
    return rows.log()


class _Rows:
    """Gathers the messages of a bag row by row."""

    def __init__(self, path: Path, bag_map: BagMap):
        self.path, self.map = path, bag_map
        self.names = {theirs: ours for ours, theirs in bag_map.joints.items()}
        self.t_ns: list[int] = []
        self.cells: dict[str, tuple[array, array]] = {}
        self.count = 0

    def add(self, topic: str, kind: str, received_ns: int, message: Any) -> None:
        """Adds one message as a row."""
        if len(self.t_ns) >= MAX_MESSAGES:
            valid = f"at most {MAX_MESSAGES} messages"
            raise InputError(self.path, topic, "more messages", valid)
        stamp = message.header.stamp
        sent_ns = int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
        row = len(self.t_ns)
        self.t_ns.append(sent_ns if self.map.clock == "header" else received_ns)
        try:
            for name, part, value in READERS[kind](message):
                if (column := self._column(topic, name, part)) is not None:
                    self._keep(column, row, value)
        except ValueError as error:
            found = f"{error} in message {row + 1}"
            raise InputError(self.path, topic, found, "whole messages") from error

    def _keep(self, column: str, row: int, value: float) -> None:
        """Adds one reading; 16 bytes each."""
        self.count += 1
        if self.count > MAX_CELLS or len(self.cells) > MAX_COLUMNS:
            valid = f"at most {MAX_CELLS} in {MAX_COLUMNS} columns"
            raise InputError(self.path, column, "more readings", valid)
        rows, values = self.cells.setdefault(column, (array("q"), array("d")))
        rows.append(row)
        values.append(value)

    def _column(self, topic: str, name: str, part: str) -> str | None:
        """Returns the column of a reading, None for a joint that is not asked for."""
        if name in ("gyro", "gravity", "base"):
            return f"{name}.{part}"
        joint = self.names.get(part) if self.names else part
        if joint is None or (topic == self.map.command and name != "pos"):
            return None
        if topic == self.map.command:
            return f"cmd.{joint}"
        return f"{self.map.effort if name == 'effort' else name}.{joint}"

    def log(self) -> MeasuredLog:
        """Returns the log of all rows; its time begins with the earliest row."""
        if not self.t_ns:
            raise InputError(self.path, "", "no message on these topics", _VALID)
        if not any(self.t_ns):
            valid = "stamps in the messages, or `clock: received`"
            raise InputError(self.path, "header.stamp", "0 everywhere", valid)
        start = min(self.t_ns)
        t_s = np.array([t - start for t in self.t_ns]) * 1e-9
        columns = {name: self._values(pairs) for name, pairs in self.cells.items()}
        return MeasuredLog(self._header(columns), t_s, columns, None, str(self.path))

    def _values(self, readings: tuple[array, array]) -> np.ndarray:
        """Returns a column, NaN in the rows of other messages."""
        values = np.full(len(self.t_ns), np.nan)
        rows, found = map(np.asarray, readings)
        values[rows] = found
        return values

    def _header(self, columns: dict[str, np.ndarray]) -> LogHeader:
        """Returns the header: joints as asked for, else in the order of their names."""
        commanded = [c.removeprefix("cmd.") for c in columns if c.startswith("cmd.")]
        kept = self.map
        joints = tuple(kept.joints) or tuple(commanded)
        if not joints:
            raise InputError(self.path, self.map.command, "no joint", "names of joints")
        return LogHeader(
            joints=joints,
            units=standard_units(columns),
            mounting=kept.mounting,
            palm_quat_w=kept.palm_quat_w,
            load=kept.load,
            settings=kept.settings,
            note=kept.note,
        )


def _check_folder(path: Path) -> None:
    """Refuses a bag whose files lead out of its folder."""
    inner = [path, *path.iterdir()] if path.is_dir() else [path]
    for file in inner:
        if not file.is_dir():
            open_regular(file, MAX_BYTES).close()
    home = path.resolve()
    for file in inner:
        if file != path and home not in file.resolve().parents:
            raise InputError(path, file.name, file.resolve(), "files inside the folder")


def _kept(path: Path) -> Iterator[tuple[str, Any]]:
    """Yields topic and contents of the messages that keep a log whole."""
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.LATEST)
    with _opened(path) as reader:
        wanted = [c for c in reader.connections if c.topic in (HEADER, ROWS, KEYS)]
        for connection, _, data in reader.messages(wanted):
            yield connection.topic, types.deserialize_cdr(data, connection.msgtype)


def _messages(path: Path, bag_map: BagMap) -> Iterator[tuple[str, str, int, Any]]:
    """Yields topic, type, time of reception [ns] and contents of the messages."""
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.LATEST)
    with _opened(path) as reader:
        wanted = _connections(path, bag_map, reader.connections)
        for connection, time_ns, data in reader.messages(wanted):
            kind = connection.msgtype
            message = types.deserialize_cdr(data, kind)
            yield connection.topic, kind, time_ns, message


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Opens a bag; whatever fails while it is read is reported in one sentence."""
    from rosbags.rosbag2 import Reader

    try:
        with Reader(path) as reader:
            yield reader
    except InputError:
        raise
    except ModuleNotFoundError:
        raise
    except (Exception, MemoryError) as error:  # a broken bag fails anywhere in there
        raise InputError(path, "", f"{type(error).__name__} {error}", _VALID) from error


def _connections(path: Path, bag_map: BagMap, connections: list) -> list:
    """Returns the connections of the topics asked for, with types that can be read."""
    topics = [bag_map.command, bag_map.state, bag_map.imu, bag_map.pose]
    known = sorted({connection.topic for connection in connections})
    for topic in filter(None, topics):
        if topic not in known:
            raise InputError(path, "topics", f"no {topic}", one_of(known, topic))
    wanted = [c for c in connections if c.topic in topics]
    for connection in wanted:
        if connection.msgtype not in READERS:
            kind, valid = connection.msgtype, one_of(READERS, connection.msgtype)
            raise InputError(path, connection.topic, kind, valid)
    return wanted
