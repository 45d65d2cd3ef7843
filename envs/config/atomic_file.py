"""Files that appear whole, synced to the disk, or not at all."""

import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

PARTIAL = ".part-"
"""Beginning of the names of files that are not whole; a killed process leaves them."""


def write_atomic(path: Path, content: str | bytes) -> Path:
    """Writes a whole file, readable by all, or leaves the old one.

    Raises:
        OSError: the disk is full or not writable; the old file is intact.
    """
    write_atomic_set({path: content})
    return path


def write_atomic_set(contents: Mapping[Path, str | bytes]) -> None:
    """Writes files that belong together: none is replaced before all are on the disk.

    A process that dies between two renames leaves new files first, old ones after.

    Raises:
        OSError: the disk is full or not writable; nothing is left behind.
    """
    with ExitStack() as stack:
        parts = {path: stack.enter_context(_beside(path)) for path in contents}
        for path, part in parts.items():
            content = contents[path]
            part.write_bytes(content.encode() if isinstance(content, str) else content)
            _finish(part)
        for path, part in parts.items():
            part.replace(path)
    for directory in {path.parent for path in contents}:
        sync(directory)


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yields a temporary path that becomes `path` if the block ends without an error.

    For libraries that write files themselves; the temporary name ends like `path`.
    """
    with _beside(path) as part:
        yield part
        _finish(part)
        part.replace(path)
    sync(path.parent)


def sync(path: Path) -> None:
    """Forces a file, or the entries of a directory, to the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def _beside(path: Path) -> Iterator[Path]:
    """Yields an empty temporary file next to `path` and removes it at the end."""
    handle, name = tempfile.mkstemp(prefix=PARTIAL, suffix=path.name, dir=path.parent)
    os.close(handle)
    try:
        yield Path(name)
    finally:
        Path(name).unlink(missing_ok=True)


def _finish(part: Path) -> None:
    """Makes a temporary file readable by all and durable."""
    part.chmod(0o644)
    sync(part)
