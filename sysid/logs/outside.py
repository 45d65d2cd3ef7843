"""Readers of logs that other installed packages bring."""

from pathlib import Path

from envs.config.plugins import found, load, origin
from envs.errors import InputError
from sysid.logs.log import MeasuredLog

READERS = "fingers.logs"
"""Entry points, named by the suffix of the files without its dot."""


def outside_suffixes() -> list[str]:
    """Suffixes that other packages read, such as ".rec"."""
    return [f".{name}" for name in found(READERS)]


def read_outside(file: Path) -> MeasuredLog:
    """Reads a log by the package that brings its suffix.

    Args:
        file: with a suffix of `outside_suffixes()`.

    Raises:
        InputError: no such log, or the package is broken; the sentence names it.
    """
    name = file.suffix.removeprefix(".")
    read = load(READERS, name, object)
    package = f"package {origin(found(READERS)[name][0])}"
    if not callable(read):
        raise InputError(package, file.suffix, type(read).__name__, "a function")
    try:
        log = read(file)
    except InputError:
        raise
    except Exception as error:
        what = f"{package}: {type(error).__name__}: {error}"
        raise InputError(file, "", what, "a log that it reads") from error
    if not isinstance(log, MeasuredLog):
        valid = "a MeasuredLog of its reader"
        raise InputError(package, file.suffix, type(log).__name__, valid)
    return log
