"""Where a command may write, looked at before it works for minutes."""

import tempfile
from pathlib import Path

from envs.errors import InputError


def check_file(option: str, path: Path | None) -> None:
    """Refuses a path to which no file can be written; nothing is left there.

    Args:
        option: that was given the path, for the message.
        path: of the file; its directories may be missing. None is not looked at.

    Raises:
        InputError: naming what is in the way.
    """
    if path is None:
        return
    if path.is_dir():
        raise InputError(option, "", f"{path}, a directory", "a file to write")
    _check_place(option, path, path.absolute().parent)


def check_directory(option: str, path: Path | None) -> None:
    """As `check_file` for a directory to write into, which may exist.

    Raises:
        InputError: naming what is in the way.
    """
    if path is not None:
        _check_place(option, path, path.absolute())


def _check_place(option: str, path: Path, directory: Path) -> None:
    """Tries the nearest directory that exists, with a file without a name."""
    while not directory.exists() and directory != directory.parent:
        directory = directory.parent
    try:
        with tempfile.TemporaryFile(dir=directory):
            return
    except OSError as error:
        found = f"{path} ({error.strerror}: {directory})"
        raise InputError(option, "", found, "a place to write to") from error
