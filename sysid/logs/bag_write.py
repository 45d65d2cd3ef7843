"""A measured log as ROS 2 bag or MCAP file, whole, and readable by other tools too.

/fingers/measured_log  std_msgs/String             header, columns and digest as JSON
/fingers/rows          std_msgs/Float64MultiArray  each row: t, then the columns
/fingers/keys          std_msgs/String             the key event of each row, if any
/joint_commands        sensor_msgs/JointState      cmd, for other tools
/joint_states          sensor_msgs/JointState      pos and vel, for other tools

The first three keep every number as it is, and are what `read_bag` reads.
"""

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from envs.config.json_file import parse_json
from envs.config.typed import from_dict, to_dict
from envs.errors import InputError
from sysid.logs.log import LogHeader, MeasuredLog

HEADER, ROWS, KEYS = "/fingers/measured_log", "/fingers/rows", "/fingers/keys"
_TEXT, _NUMBERS = "std_msgs/msg/String", "std_msgs/msg/Float64MultiArray"
_JOINTS = "sensor_msgs/msg/JointState"


def write_bag(log: MeasuredLog, path: Path) -> None:
    """Writes a log as the folder of a ROS 2 bag with MCAP storage.

    Raises:
        InputError: something of that name is there.
        ModuleNotFoundError: rosbags, of the optional dependencies `data`, is missing.
    """
    if path.exists():
        raise InputError(path, "", "something that exists", "a folder to make")
    with tempfile.TemporaryDirectory(dir=path.absolute().parent) as folder:
        _written(log, Path(folder) / path.name).rename(path)


def write_mcap(log: MeasuredLog, path: Path) -> None:
    """Writes a log as one MCAP file; it appears whole or not.

    Raises:
        ModuleNotFoundError: rosbags, of the optional dependencies `data`, is missing.
    """
    with tempfile.TemporaryDirectory(dir=path.absolute().parent) as folder:
        (inner,) = _written(log, Path(folder) / path.stem).glob("*.mcap")
        inner.replace(path)


def kept_log(path: Path, messages: Iterator[tuple[str, Any]]) -> MeasuredLog:
    """Returns the log that `write_bag` or `write_mcap` wrote.

    Args:
        path: of the bag, for messages.
        messages: topic and contents of its own three topics, in recorded order.

    Raises:
        InputError: contents that are not what was written.
    """
    said, rows, keys = "", [], []
    for topic, message in messages:
        if topic == HEADER:
            said = message.data
        elif topic == ROWS:
            rows.append(np.array(message.data))
        else:
            keys.append(message.data)
    valid = "what was written; copy it again"
    data = parse_json(said, f"{path} {HEADER}")
    try:
        names, digest = data.pop("columns"), data.pop("sha256")
        table = np.stack(rows).T
        columns = dict(zip(names, table[1:], strict=True))
    except (AttributeError, KeyError, ValueError, TypeError) as error:
        raise InputError(path, HEADER, error, valid) from error
    key = np.asarray(keys, dtype=str) if keys else None
    header = from_dict(LogHeader, data, path)
    log = MeasuredLog(header, table[0], columns, key, str(path))
    if log.sha256 != digest:
        raise InputError(path, "sha256", "other contents", valid)
    return log


def _written(log: MeasuredLog, folder: Path) -> Path:
    """Writes the folder of a bag."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.LATEST)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        opened: dict[str, Any] = {}
        for topic, kind, time_ns, message in _messages(log, types.types):
            if topic not in opened:
                opened[topic] = writer.add_connection(topic, kind, typestore=types)
            data = types.serialize_cdr(message, kind)
            writer.write(opened[topic], time_ns, data)
    return folder


def _messages(log: MeasuredLog, types: Any) -> Iterator[tuple[str, str, int, Any]]:
    """Yields topic, type, time [ns] and message."""
    text, names = types[_TEXT], list(log.columns)
    header = {**to_dict(log.header), "columns": names, "sha256": log.sha256}
    yield HEADER, _TEXT, 0, text(json.dumps(header, ensure_ascii=False))
    layout = types["std_msgs/msg/MultiArrayLayout"]([], 0)
    table = np.stack([log.t_s, *log.columns.values()], axis=1)
    stamps = np.round((log.t_s - log.t_s.min()) * 1e9).astype(int)
    for row, time_ns in enumerate(stamps.tolist()):
        yield ROWS, _NUMBERS, time_ns, types[_NUMBERS](layout, table[row])
        if log.key is not None:
            yield KEYS, _TEXT, time_ns, text(str(log.key[row]))
        for topic, quantities in {
            "/joint_commands": ("cmd",),
            "/joint_states": ("pos", "vel"),
        }.items():
            if message := _joint_state(log, row, time_ns, quantities, types):
                yield topic, _JOINTS, time_ns, message


def _joint_state(
    log: MeasuredLog, row: int, time_ns: int, quantities: tuple[str, ...], types: Any
) -> Any:
    """Returns what a row says of joints, None if it lacks one of them."""
    values = {}
    for quantity in quantities:
        columns = [log.columns.get(f"{quantity}.{j}") for j in log.header.joints]
        if all(column is not None for column in columns):
            values[quantity] = np.array([column[row] for column in columns])  # pyright: ignore
    first = values.pop(quantities[0])
    if np.isnan(first).any():
        return None
    others = [v if not np.isnan(v).any() else np.zeros(0) for v in values.values()]
    velocity = others[0] if others else np.zeros(0)
    stamp = types["builtin_interfaces/msg/Time"](time_ns // 10**9, time_ns % 10**9)
    header = types["std_msgs/msg/Header"](stamp, "")
    names = list(log.header.joints)
    return types[_JOINTS](header, names, first, velocity, np.zeros(0))
