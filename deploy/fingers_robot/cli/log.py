"""`fingers-deploy log`: what a recorded run contains; as CSV for other tools."""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from fingers_deploy.errors import InputError
from fingers_robot.record.log import Log, read_log

_WIDEST = 100


def add_log(commands: Any) -> None:
    """Adds the command."""
    parser = commands.add_parser("log", help="show a recorded run, or convert it")
    parser.add_argument("file", help="MCAP file of a run")
    parser.add_argument("--csv", metavar="FILE", help="write the columns as CSV")
    parser.set_defaults(command=show)


def show(options: argparse.Namespace) -> int:
    """Prints a summary, and writes the CSV if asked."""
    log = read_log(options.file)
    rows = log.rows
    length_s = float(rows["t"][-1] - rows["t"][0]) if len(rows) else 0.0
    print(f"{log.source}: {len(rows)} rows, {length_s:.1f} s")
    if not log.complete:
        print("the recording was cut off: it ends with its last whole second")
    for name, value in (log.metadata | log.summary).items():
        print(f"  {name:15} {value[:_WIDEST]}{'…' * (len(value) > _WIDEST)}")
    for t_s, line in log.events:
        print(f"  {t_s:9.3f} s  {line}")
    if options.csv:
        write_csv(log, Path(options.csv))
    return 0


def write_csv(log: Log, path: Path) -> None:
    """Writes all columns with a header; numbers read back to the same bits.

    Raises:
        InputError: the file cannot be written.
    """
    columns = log.columns()
    try:
        with path.open("x", encoding="ascii") as file:
            file.write(",".join(columns) + "\n")
            for row in zip(*columns.values(), strict=True):
                file.write(",".join(_number(value) for value in row) + "\n")
    except OSError as error:
        raise InputError(path, "", error.strerror, "a new file") from error
    print(f"wrote {path}", file=sys.stderr)


def _number(value: np.generic) -> str:
    return str(value)
