"""What a worker has for itself: cores and GPUs that no other of this user has."""

import fcntl
import os
import subprocess
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

DIRECTORY = "fingers-{kind}-{user}"
CORES, GPUS = "cores", "gpus"
VISIBLE = "CUDA_VISIBLE_DEVICES"


class Held:
    """Some of the numbered things of this machine, which nobody else holds meanwhile.

    A thing is held by locking a file, which the system frees however this process ends.

    Args:
        kind: of things, `CORES` or `GPUS`.
        names: of all that there are.
        number: how many to hold; if fewer are free, or it is None, none is held.

    Attributes:
        names: of those that are held.
    """

    def __init__(self, kind: str, names: Sequence[str], number: int | None):
        self._handles: dict[str, int] = {}
        if number is None or not names:
            return
        place = DIRECTORY.format(kind=kind, user=os.getuid())
        directory = Path(tempfile.gettempdir()) / place
        directory.mkdir(mode=0o700, exist_ok=True)
        for name in names:
            if len(self._handles) < number:
                self._try(name, directory / f"{name}.lock")
        if len(self._handles) < number:
            self.free()

    @property
    def names(self) -> list[str]:
        """Names of what is held."""
        return list(self._handles)

    def free(self) -> None:
        """Leaves them to others; more than once does no harm."""
        while self._handles:
            os.close(self._handles.popitem()[1])

    def _try(self, name: str, path: Path) -> None:
        """Holds one if nobody else does."""
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._handles[name] = handle
        except BlockingIOError:
            os.close(handle)


def cores() -> list[str]:
    """Returns the cores on which this process may run; none where that is unknown."""
    usable = getattr(os, "sched_getaffinity", None)
    return [str(core) for core in sorted(usable(0))] if usable else []


def gpus() -> list[str]:
    """Returns the GPUs that this process sees, as `CUDA_VISIBLE_DEVICES` names them."""
    given = os.environ.get(VISIBLE)
    if given is not None:
        return [name.strip() for name in given.split(",") if name.strip()]
    return gpu_facts("index")


def gpu_facts(field: str) -> list[str]:
    """Returns one fact of each NVIDIA GPU of this machine; none without its driver.

    Args:
        field: as `nvidia-smi --query-gpu` names it.
    """
    query = ["nvidia-smi", f"--query-gpu={field}", "--format=csv,noheader,nounits"]
    with suppress(OSError, subprocess.SubprocessError):
        done = subprocess.run(query, capture_output=True, text=True, check=True)
        return done.stdout.split()
    return []
