"""Opening what a user names: regular files only, of a size that is known before."""

import os
import stat
from pathlib import Path
from typing import BinaryIO

from fingers_deploy.errors import InputError

_KINDS = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a folder",
}


def open_regular(
    path: str | Path, most: int, error: type[InputError] = InputError
) -> BinaryIO:
    """Opens a regular file to read its bytes; never waits for one that is none.

    Args:
        path: the file, or a link to it.
        most: largest size [bytes].
        error: class of the errors.

    Raises:
        InputError: it is missing, unreadable, no regular file, or larger.
    """
    valid = f"a regular file of at most {size_text(most)}"
    try:
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode):
            kind = _KINDS.get(stat.S_IFMT(found.st_mode), "a special file")
            raise error(path, "", kind, valid)
        file = open(path, "rb", opener=_without_waiting)  # noqa: SIM115
    except (OSError, ValueError) as problem:
        if isinstance(problem, InputError):
            raise
        raise error(path, "", reason(problem), valid) from problem
    found = os.fstat(file.fileno())  # of what was opened, whatever came between
    sound = stat.S_ISREG(found.st_mode) and _answers(file.fileno())
    if sound and found.st_size <= most:
        return file
    file.close()
    kind = f"{found.st_size} bytes" if sound else "a special file"
    raise error(path, "", kind, valid)


def read_regular(
    path: str | Path, most: int, error: type[InputError] = InputError
) -> bytes:
    """Reads a regular file as `open_regular` opens it, all of it.

    Raises:
        InputError: as `open_regular`, or it cannot be read.
    """
    with open_regular(path, most, error) as file:
        try:
            return file.read(most)
        except OSError as problem:
            raise error(path, "", reason(problem), "a readable file") from problem


def is_folder(path: str | Path, error: type[InputError] = InputError) -> bool:
    """Whether a path leads to a folder.

    Raises:
        InputError: it is no path, as one of 5,000 characters.
    """
    try:
        return Path(path).is_dir()
    except (OSError, ValueError) as problem:
        raise error(path, "", reason(problem), "a path that can be read") from problem


def reason(problem: Exception) -> str:
    """What went wrong, without the path, which the sentence names anyway."""
    return getattr(problem, "strerror", None) or str(problem)


def size_text(count: int) -> str:
    """A number of bytes in words."""
    return f"{count >> 20} MiB" if count >= 1 << 20 else f"{count >> 10} KiB"


def _answers(handle: int) -> bool:
    """Whether reading returns; files of the kernel call themselves regular as well."""
    try:
        os.pread(handle, 1, 0)
    except OSError:
        return False
    return True


def _without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NONBLOCK)
