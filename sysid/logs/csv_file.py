"""Measured logs as CSV: a YAML header in `#` lines or in a file beside it, then rows.

    # schema: 1
    # joints: [knee]
    # units: {cmd: rad, pos: rad}
    t,cmd.knee,pos.knee
    0.000,0.10,0.08
    0.002,0.11,

An empty cell is a missing reading. The file beside `log.csv` is `log.yaml`.
"""

import csv
import io
import math
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from envs.config.atomic_file import atomic_path
from envs.config.strict_yaml import parse_yaml
from envs.config.typed import dump_yaml, from_dict, load_yaml
from envs.errors import InputError
from fingers_deploy.files import open_regular
from sysid.logs.columns import MAX_CELLS, MAX_COLUMNS
from sysid.logs.log import LogHeader, MeasuredLog

MAX_BYTES = 1 << 30
_MAX_HEADER_LINES = 1000
_MAX_LINE = 1 << 18
_PART = 1 << 20


def read_csv(path: Path) -> MeasuredLog:
    """Reads a log from CSV.

    Raises:
        InputError: not such a file; names the line where a cell is wrong.
    """
    try:
        with open_regular(path, MAX_BYTES) as file:
            _check_amount(file, path)
            stream = io.TextIOWrapper(file, encoding="utf-8", newline="")
            comments, names, first = _head(stream, path)
            cells = _cells(stream, path, names, first)
    except (OSError, ValueError, csv.Error) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(path, "", error, "a CSV file in UTF-8") from error
    return _log(path, _header(path, comments), names, cells)


def write_csv(log: MeasuredLog, path: Path) -> None:
    """Writes a log that `read_csv` reads back exactly; it appears whole or not."""
    names = ["t", *log.columns, *(["key"] if log.key is not None else [])]
    arrays = [log.t_s, *log.columns.values()]
    with (
        atomic_path(path) as part,
        open(part, "w", encoding="utf-8", newline="") as stream,
    ):
        stream.writelines(f"# {x}\n" for x in dump_yaml(log.header).splitlines())
        writer = csv.writer(stream)
        writer.writerow(names)
        for i, row in enumerate(zip(*arrays, strict=True)):
            keys = [] if log.key is None else [log.key[i]]
            writer.writerow([_text(x) for x in row] + keys)


def _text(value: float) -> str:
    """Writes a number so that it reads back exactly; a missing reading is empty."""
    return "" if math.isnan(value) else repr(float(value))


def _head(stream: Iterator[str], path: Path) -> tuple[list[str], list[str], int]:
    """Reads `#` lines and column names; returns them and the next line's number."""
    comments: list[str] = []
    for line in stream:
        if not line.startswith("#"):
            names = [cell.strip() for cell in next(csv.reader([line]), [])]
            return comments, _checked_names(path, names), len(comments) + 2
        comments.append(line[1:].removeprefix(" ").rstrip("\r\n"))
        if len(comments) > _MAX_HEADER_LINES:
            break
    raise InputError(path, "", "no row of column names", "a CSV file with t, cmd, pos")


def _checked_names(path: Path, names: list[str]) -> list[str]:
    """Refuses a table without times or with a column twice."""
    if "t" not in names:
        raise InputError(path, "columns", ", ".join(names), "a column t [s]")
    if len(names) > MAX_COLUMNS:
        found, valid = f"{len(names)} columns", f"at most {MAX_COLUMNS}"
        raise InputError(path, "columns", found, valid)
    for name in names:
        if names.count(name) > 1:
            raise InputError(path, "columns", f"{name} twice", "every column once")
    return names


def _check_amount(file: BinaryIO, path: Path) -> None:
    """Refuses more cells, or longer lines, than are read in reasonable memory."""
    cells = since = 0
    while part := file.read(_PART):
        cells += part.count(b",") + part.count(b"\n")
        first, last = part.find(b"\n"), part.rfind(b"\n")
        since = since + len(part) if last < 0 else len(part) - last
        if cells > MAX_CELLS:
            raise InputError(path, "", "more cells", f"at most {MAX_CELLS}")
        if max(since, first) > _MAX_LINE:
            valid = f"lines of at most {_MAX_LINE} bytes"
            raise InputError(path, "", "a longer line", valid)
    file.seek(0)


def _cells(stream: Iterator[str], path: Path, names: list[str], first: int):
    """Returns the columns in order: numbers, and text for `key`."""
    # Eight bytes a number, where a list takes forty.
    columns: list[Any] = [[] if name == "key" else array("d") for name in names]
    numbers = [name != "key" for name in names]
    reader = csv.reader(stream)
    for row in reader:
        line = first + reader.line_num - 1
        if len(row) != len(names):
            valid = f"{len(names)} cells, as many as columns"
            raise InputError(path, f"line {line}", f"{len(row)} cells", valid)
        for column, cell, numeric in zip(columns, row, numbers, strict=True):
            column.append(_number(cell, path, line) if numeric else cell)
    return columns


def _number(cell: str, path: Path, line: int) -> float:
    """Reads one cell."""
    if not cell.strip():
        return math.nan
    try:
        return float(cell)
    except ValueError:
        valid = "a number, or nothing for a missing reading"
        raise InputError(path, f"line {line}", cell, valid) from None


def _header(path: Path, comments: list[str]) -> LogHeader:
    """Reads the header from the `#` lines or from the YAML file beside the log."""
    beside = path.with_suffix(".yaml")
    if comments:
        data = parse_yaml("\n".join(comments), path)
        return from_dict(LogHeader, data, path)
    if not beside.exists():
        valid = f"a header in # lines or in {beside.name} beside it"
        raise InputError(path, "header", "none", valid)
    return load_yaml(LogHeader, beside)


def _log(path: Path, header: LogHeader, names: list[str], cells: list) -> MeasuredLog:
    """Puts header and columns together."""
    table = dict(zip(names, cells, strict=True))
    key = np.asarray(table.pop("key"), dtype=str) if "key" in table else None
    t_s = np.asarray(table.pop("t"), dtype=float)
    columns = {name: np.asarray(values, dtype=float) for name, values in table.items()}
    return MeasuredLog(header, t_s, columns, key, str(path))
