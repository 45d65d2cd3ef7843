"""Measured logs as Parquet: one column each, the header in the schema's metadata."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from envs.config.atomic_file import atomic_path
from envs.config.json_file import parse_json
from envs.config.typed import from_dict, to_dict
from envs.errors import InputError
from fingers_deploy.files import open_regular
from sysid.logs.columns import MAX_CELLS, MAX_COLUMNS
from sysid.logs.log import LogHeader, MeasuredLog

METADATA_KEY = b"fingers.measured_log"
MAX_BYTES = 1 << 30
_VALID = "a Parquet file with numeric columns"


def read_parquet(path: Path) -> MeasuredLog:
    """Reads a log from Parquet.

    Raises:
        InputError: not such a file, or its contents are not those that `write_parquet`
            wrote (files of other programs carry no digest).
        ModuleNotFoundError: pyarrow, of the optional dependencies `data`, is missing.
    """
    import pyarrow
    import pyarrow.parquet

    try:
        # `open` keeps to this one file: a path given to pyarrow may name a data set.
        with open_regular(path, MAX_BYTES) as stream:
            file = pyarrow.parquet.ParquetFile(stream)
            header, digest = _header(path, file.schema_arrow.metadata or {})
            if file.metadata.num_columns > MAX_COLUMNS:
                found = f"{file.metadata.num_columns} columns"
                raise InputError(path, "", found, f"at most {MAX_COLUMNS}")
            cells = file.metadata.num_rows * file.metadata.num_columns
            if not 0 <= cells <= MAX_CELLS:
                raise InputError(path, "", f"{cells} cells", f"at most {MAX_CELLS}")
            columns = _columns(path, file.read())
    except (OSError, pyarrow.ArrowException, UnicodeDecodeError) as error:
        raise InputError(path, "", error, _VALID) from error
    if "t" not in columns:
        raise InputError(path, "columns", ", ".join(columns), "a column t [s]")
    key, t_s = columns.pop("key", None), columns.pop("t")
    log = MeasuredLog(header, t_s, columns, key, str(path))
    if digest not in ("", log.sha256):
        valid = "what was written; copy the file again"
        raise InputError(path, "sha256", "other contents", valid)
    return log


def write_parquet(log: MeasuredLog, path: Path) -> None:
    """Writes a log that `read_parquet` reads back exactly; it appears whole or not.

    Raises:
        ModuleNotFoundError: pyarrow, of the optional dependencies `data`, is missing.
    """
    import pyarrow
    import pyarrow.parquet

    columns: dict[str, Any] = {"t": log.t_s, **log.columns}
    columns = {k: pyarrow.array(v, mask=np.isnan(v)) for k, v in columns.items()}
    if log.key is not None:
        columns["key"] = pyarrow.array(log.key.tolist(), pyarrow.string())
    header = {**to_dict(log.header), "sha256": log.sha256}
    text = json.dumps(header, ensure_ascii=False).encode()
    table = pyarrow.table(columns).replace_schema_metadata({METADATA_KEY: text})
    with atomic_path(path) as part:
        pyarrow.parquet.write_table(table, part)


def _header(path: Path, metadata: dict[bytes, bytes]) -> tuple[LogHeader, str]:
    """Reads header and digest ("" if there is none) from the metadata of the schema."""
    field = METADATA_KEY.decode()
    if METADATA_KEY not in metadata:
        raise InputError(path, f"metadata {field}", "", "the header of a log as JSON")
    data = parse_json(metadata[METADATA_KEY], f"{path} metadata {field}")
    digest = data.pop("sha256", "") if isinstance(data, dict) else ""
    return from_dict(LogHeader, data, path), digest


def _columns(path: Path, table: Any) -> dict[str, np.ndarray]:
    """Returns the columns as arrays: float64, text for `key`."""
    names = table.column_names
    if len(set(names)) < len(names):
        raise InputError(path, "columns", ", ".join(names), "every column once")
    return {name: _column(path, name, table.column(name)) for name in names}


def _column(path: Path, name: str, column: Any) -> np.ndarray:
    """Returns one column; nulls are missing readings."""
    from pyarrow import types

    kind = column.type
    if name == "key":
        if not (types.is_string(kind) or types.is_large_string(kind)):
            raise InputError(path, name, kind, "text")
        return np.asarray([text or "" for text in column.to_pylist()], dtype=str)
    if not (types.is_floating(kind) or types.is_integer(kind)):
        raise InputError(path, name, kind, "numbers")
    return column.cast("float64").to_numpy()
