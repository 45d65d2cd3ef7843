"""Worker processes: started on cores of their own, asked to stop, ended with us."""

import fcntl
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from envs.rounding import VARIABLE as XLA
from envs.rounding import fix_rounding

WORKER = (sys.executable, "-P", "-m", "fingers_mjx.studies.sweep.worker")
"""Command of a worker; what it trains follows."""
CORES = "fingers-cores-{user}"


class Process:
    """A worker process, which ends when the process that made this object does.

    It has a session of its own, so that Ctrl-C reaches it through `stop` alone: twice
    would end it before it has saved.

    Args:
        command: words of the command line.
        log: file to which its output is appended.
        environment: variables besides ours.
        threads: cores on which it runs alone, as far as so many are left.
    """

    def __init__(
        self,
        command: Sequence[str],
        log: Path,
        environment: Mapping[str, str],
        threads: int | None = None,
    ):
        log.parent.mkdir(parents=True, exist_ok=True)
        self._cores = Cores(threads)
        with log.open("ab") as stream:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=stream,
                stderr=subprocess.STDOUT,
                env={**os.environ, **environment},
                start_new_session=True,
            )
        self._cores.give(self._process.pid)

    def poll(self) -> int | None:
        """Returns the exit status, negative for a signal, or None while it runs."""
        status = self._process.poll()
        if status is not None:
            if self._process.stdin is not None:
                self._process.stdin.close()
            self._cores.free()
        return status

    def stop(self) -> None:
        """Asks it to save and end."""
        with suppress(ProcessLookupError):
            self._process.send_signal(signal.SIGTERM)


class Cores:
    """Cores of this machine that no other worker of this user has.

    Processes that step on each other's cores wait for each other's threads. A core is
    held by locking a file, which the system frees however this process ends.

    Args:
        number: of cores; if fewer are free, or it is None, none is held.
    """

    def __init__(self, number: int | None):
        self._held: dict[int, int] = {}
        if number is None or not hasattr(os, "sched_setaffinity"):
            return
        directory = Path(tempfile.gettempdir()) / CORES.format(user=os.getuid())
        directory.mkdir(mode=0o700, exist_ok=True)
        for core in sorted(os.sched_getaffinity(0)):
            if len(self._held) < number:
                self._try(core, directory / f"{core}.lock")
        if len(self._held) < number:
            self.free()

    def give(self, process: int) -> None:
        """Lets a process run on these cores alone; on all if none is held."""
        if self._held:
            with suppress(ProcessLookupError):
                os.sched_setaffinity(process, set(self._held))

    def free(self) -> None:
        """Leaves the cores to others; more than once does no harm."""
        while self._held:
            os.close(self._held.popitem()[1])

    def _try(self, core: int, path: Path) -> None:
        """Holds a core if nobody else does."""
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._held[core] = handle
        except BlockingIOError:
            os.close(handle)


def worker_environment(threads: int | None, backend: str | None) -> dict[str, str]:
    """Returns the variables of a worker.

    XLA and BLAS split sums among their threads, so that the last bits of a result
    depend on their number: it is fixed, whichever machine a worker gets to, and so is
    what `fix_rounding` asks for.

    Args:
        threads: of a worker; as many as it finds cores if None.
        backend: physics backend; only Warp's workers look for a GPU.
    """
    here = str(Path(__file__).parents[3])
    path = os.pathsep.join(filter(None, (here, os.environ.get("PYTHONPATH", ""))))
    found = {"PYTHONPATH": path, "PYTHONUNBUFFERED": "1", "TF_CPP_MIN_LOG_LEVEL": "3"}
    found[XLA] = os.environ.get(XLA, "")
    fix_rounding(found)
    if backend != "warp":
        found["JAX_PLATFORMS"] = "cpu"
    if threads is not None:
        found |= dict.fromkeys(("PJRT_NPROC", "OMP_NUM_THREADS"), str(threads))
    return found
