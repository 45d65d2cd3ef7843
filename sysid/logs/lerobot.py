"""Measured logs as LeRobot datasets: Parquet frames beside `meta/info.json`.

| log | feature of the dataset |
|---|---|
| `cmd.<joint>` | `action`, one number a joint |
| `pos.<joint>` | `observation.state`, one number a joint |
| `<quantity>.<part>` | `observation.<quantity>`, one number a column |
| `t` | `observation.t_s`; `timestamp` is that of the frame rate |
| `key` | `observation.key` |
| header | `fingers_measured_log` in `meta/info.json` |

A dataset has one rate: a log whose rows are not evenly spaced is refused. Numbers are
float64 and missing readings NaN, so a log comes back as it was. Datasets of others are
read with a header of the user's, their versions 2 and 3 alike.
"""

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from envs.config.json_file import read_table
from envs.config.typed import from_dict, to_dict
from envs.errors import InputError
from fingers_deploy.files import open_regular
from sysid.logs.columns import MAX_CELLS, quantity_of
from sysid.logs.log import LogHeader, MeasuredLog

INFO = "meta/info.json"
OWN = "fingers_measured_log"
MAX_BYTES = 1 << 30
TOLERANCE_S = 1e-4
"""By which LeRobot lets a time differ from that of its frame [s]."""

_JOINT_FEATURES = {"cmd": "action", "pos": "observation.state"}
_DATA = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
_T, _KEY = "observation.t_s", "observation.key"


def is_lerobot(path: Path) -> bool:
    """Whether a folder is a LeRobot dataset."""
    return (path / INFO).is_file()


def read_lerobot(
    path: Path, header: LogHeader | None = None, episode: int = 0
) -> MeasuredLog:
    """Reads one episode of a dataset.

    Args:
        path: folder of the dataset.
        header: joints in the order of `action` and units, of a dataset that
            `write_lerobot` did not write.
        episode: its number.

    Raises:
        InputError: no such dataset or episode, or nothing says what its numbers are.
        ModuleNotFoundError: pyarrow, of the optional dependencies `data`, is missing.
    """
    info = read_table(path / INFO)
    kept = info.get(OWN)
    if header is None and kept is None:
        valid = "a dataset that `fingers log convert` wrote, or --header FILE"
        raise InputError(path / INFO, OWN, "nothing", valid)
    own = dict(kept) if isinstance(kept, dict) and header is None else {}
    digest = own.pop("sha256", "")
    header = header or from_dict(LogHeader, own, path / INFO)
    frames = _frames(path, episode)
    columns = _columns(path, info, header, frames)
    exact = _T in frames
    t_s = np.asarray(frames[_T if exact else "timestamp"], dtype=float)
    key = np.asarray(frames[_KEY], dtype=str) if _KEY in frames else None
    log = MeasuredLog(header, t_s, columns, key, str(path))
    if digest not in ("", log.sha256):
        valid = "what was written; copy the dataset again"
        raise InputError(path, "sha256", "other contents", valid)
    return log


def write_lerobot(log: MeasuredLog, path: Path) -> None:
    """Writes a log as a dataset of one episode (version 2.1); whole or not at all.

    Raises:
        InputError: something of that name is there, or rows that are not evenly spaced.
        ModuleNotFoundError: pyarrow, of the optional dependencies `data`, is missing.
    """
    if path.exists():
        raise InputError(path, "", "something that exists", "a folder to make")
    fps = _frame_rate(log)
    with tempfile.TemporaryDirectory(dir=path.absolute().parent) as folder:
        made = Path(folder) / path.name
        (made / "meta").mkdir(parents=True)
        features, table = _table(log, fps)
        _write_parquet(made / _DATA.format(episode_chunk=0, episode_index=0), table)
        for name, content in _meta(log, fps, features).items():
            text = json.dumps(content, ensure_ascii=False)
            (made / "meta" / name).write_text(f"{text}\n", "utf-8")
        made.rename(path)


def _frame_rate(log: MeasuredLog) -> float:
    """Returns frames per second, or refuses rows that are not evenly spaced."""
    period_s = (log.t_s[-1] - log.t_s[0]) / (len(log) - 1)
    even = log.t_s[0] + period_s * np.arange(len(log))
    worst = float(np.abs(log.t_s - even).max())
    if not period_s > 0 or worst > TOLERANCE_S:
        found = f"a row {worst:.3g} s off an even rate"
        valid = f"rows evenly spaced to {TOLERANCE_S:g} s, as a LeRobot dataset has"
        raise InputError(log.source, "t", found, valid)
    return round(1.0 / period_s, 6)


def _table(log: MeasuredLog, fps: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Returns the features, and the columns of the file."""
    features: dict[str, Any] = {}
    table: dict[str, Any] = {}
    for quantity in dict.fromkeys(map(quantity_of, log.columns)):
        names = [name for name in log.columns if quantity_of(name) == quantity]
        if quantity in _JOINT_FEATURES:
            names = [f"{quantity}.{joint}" for joint in log.header.joints]
        feature = _JOINT_FEATURES.get(quantity, f"observation.{quantity}")
        parts = [name.partition(".")[2] or name for name in names]
        features[feature] = _feature("float64", len(names), parts)
        table[feature] = np.stack([log.columns[name] for name in names], axis=1)
    features[_T], table[_T] = _feature("float64", 1), log.t_s
    if log.key is not None:
        features[_KEY], table[_KEY] = _feature("string", 1), log.key.tolist()
    count = np.arange(len(log))
    features["timestamp"] = _feature("float32", 1)
    table["timestamp"] = (count / fps).astype(np.float32)
    indices = {"frame_index": count, "episode_index": 0 * count}
    for name, values in (indices | {"index": count, "task_index": 0 * count}).items():
        features[name], table[name] = _feature("int64", 1), values
    return features, table


def _feature(kind: str, size: int, names: list[str] | None = None) -> dict[str, Any]:
    return {"dtype": kind, "shape": [size], "names": names}


def _meta(log: MeasuredLog, fps: float, features: dict[str, Any]) -> dict[str, Any]:
    """Returns the files of the folder `meta`, by name."""
    info = {
        "codebase_version": "v2.1",
        "robot_type": "hand",
        "total_episodes": 1,
        "total_frames": len(log),
        "total_tasks": 1,
        "total_videos": 0,
        "total_chunks": 1,
        "chunks_size": 1000,
        "fps": fps,
        "splits": {"train": "0:1"},
        "data_path": _DATA,
        "video_path": None,
        "features": features,
        OWN: {**to_dict(log.header), "sha256": log.sha256},
    }
    task = log.header.note or "measured log"
    episode = {"episode_index": 0, "tasks": [task], "length": len(log)}
    return {
        "info.json": info,
        "tasks.jsonl": {"task_index": 0, "task": task},
        "episodes.jsonl": episode,
    }


def _write_parquet(path: Path, table: dict[str, Any]) -> None:
    import pyarrow
    import pyarrow.parquet

    columns = {
        name: pyarrow.array(values.tolist(), pyarrow.list_(pyarrow.float64()))
        if isinstance(values, np.ndarray) and values.ndim == 2
        else pyarrow.array(values)
        for name, values in table.items()
    }
    path.parent.mkdir(parents=True)
    pyarrow.parquet.write_table(pyarrow.table(columns), path)


def _frames(path: Path, episode: int) -> dict[str, list]:
    """Returns the columns of one episode, from whichever files hold it."""
    import pyarrow
    import pyarrow.parquet

    found: list[Any] = []
    try:
        for file in sorted((path / "data").rglob("*.parquet")):
            with open_regular(file, MAX_BYTES) as stream:
                table = pyarrow.parquet.ParquetFile(stream).read()
            if table.num_rows * table.num_columns > MAX_CELLS:
                raise InputError(file, "", "more cells", f"at most {MAX_CELLS}")
            index = table.column("episode_index").to_numpy()
            found.append(table.filter(pyarrow.array(index == episode)))
        rows = pyarrow.concat_tables(found)
    except (OSError, KeyError, ValueError, pyarrow.ArrowException) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(path, "data", error, "Parquet files of frames") from error
    if not rows.num_rows:
        raise InputError(path, "episode", episode, "an episode of the dataset")
    return {name: rows.column(name).to_pylist() for name in rows.column_names}


def _columns(
    path: Path, info: dict[str, Any], header: LogHeader, frames: dict[str, list]
) -> dict[str, np.ndarray]:
    """Returns the columns of the log."""
    columns: dict[str, np.ndarray] = {}
    for quantity, unit in header.units.items():
        del unit
        feature = _JOINT_FEATURES.get(quantity, f"observation.{quantity}")
        if feature not in frames:
            raise InputError(path, "features", f"no {feature}", f"{quantity} of it")
        values = np.array(frames[feature], dtype=float).reshape(
            len(frames[feature]), -1
        )
        parts = list(header.joints)
        if quantity not in _JOINT_FEATURES:
            parts = info["features"][feature]["names"]
        if len(parts) != values.shape[1]:
            found = f"{values.shape[1]} numbers"
            raise InputError(path, feature, found, f"{len(parts)}: {', '.join(parts)}")
        for part, column in zip(parts, values.T, strict=True):
            columns[quantity if part == quantity else f"{quantity}.{part}"] = column
    return columns
