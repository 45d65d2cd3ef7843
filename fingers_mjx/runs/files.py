"""Files of a run: written whole or not at all, readable by all, full disks named."""

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from envs.config.atomic_file import write_atomic

FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


class OutOfSpace(OSError):
    """The disk has no space for what should be written (status 4).

    Args:
        path: what was being written.
        needed: its size [bytes].
        free: free space on the disk [bytes].
    """

    exit_code = 4

    def __init__(self, path: Path, needed: int, free: int):
        self.path, self.needed, self.free = path, needed, free
        super().__init__(
            f"no room for {path}: needs {needed:,} bytes, {free:,} free; "
            "what was saved before is intact"
        )


@contextmanager
def room_for(path: Path, needed: int) -> Iterator[None]:
    """Turns every sign of a full disk while `path` is written into OutOfSpace.

    Args:
        path: what is written; its directory exists.
        needed: its size [bytes]; if the disk has less, nothing is tried.

    Raises:
        OutOfSpace: naming the path and the bytes needed.
    """
    if _free(path.parent) < needed:
        raise OutOfSpace(path, needed, _free(path.parent))
    try:
        yield
    except Exception as error:
        if not is_full(error):
            raise
        raise OutOfSpace(path, needed, _free(path.parent)) from error


def is_full(error: BaseException) -> bool:
    """Whether `error` means a full disk, a quota or a limit of file size.

    Orbax reports what its C++ layer met as text only.
    """
    if isinstance(error, OSError) and error.errno in FULL:
        return True
    return any(os.strerror(number) in str(error) for number in FULL)


def write_whole(path: Path, content: bytes) -> None:
    """Writes a file atomically.

    Raises:
        OutOfSpace: if the disk is full; the old file is intact.
    """
    with room_for(path, len(content)):
        write_atomic(path, content)


def _free(directory: Path) -> int:
    """Returns the free space on the disk of `directory` [bytes]."""
    return shutil.disk_usage(directory).free
