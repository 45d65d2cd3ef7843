"""Worker processes: on cores and GPUs of their own, asked to stop, ended with us."""

import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from envs.config.xla_flags import VARIABLE as XLA
from envs.rounding import fix_rounding
from fingers_mjx.studies.sweep.engines.held import (
    CORES,
    GPUS,
    VISIBLE,
    Held,
    cores,
    gpus,
)

WORKER = (sys.executable, "-P", "-m", "fingers_mjx.studies.sweep.worker")
"""Command of a worker; what it trains follows."""


class Process:
    """A worker process, which ends when the process that made this object does.

    It has a session of its own, so that Ctrl-C reaches it through `stop` alone: twice
    would end it before it has saved.

    Args:
        command: words of the command line.
        log: file to which its output is appended.
        environment: variables besides ours.
        threads: cores on which it runs alone, as far as so many are left: processes
            that step on each other's cores wait for each other's threads.
        own_gpu: whether it has a GPU to itself, as far as one is left.
    """

    def __init__(
        self,
        command: Sequence[str],
        log: Path,
        environment: Mapping[str, str],
        threads: int | None = None,
        own_gpu: bool = False,
    ):
        log.parent.mkdir(parents=True, exist_ok=True)
        self._cores = Held(CORES, cores(), threads)
        self._gpu = Held(GPUS, gpus() if own_gpu else [], 1)
        visible = dict(zip([VISIBLE], self._gpu.names, strict=False))
        with log.open("ab") as stream:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=stream,
                stderr=subprocess.STDOUT,
                env={**os.environ, **environment, **visible},
                start_new_session=True,
            )
        if self._cores.names:
            with suppress(ProcessLookupError):
                own = {int(name) for name in self._cores.names}
                os.sched_setaffinity(self._process.pid, own)

    def poll(self) -> int | None:
        """Returns the exit status, negative for a signal, or None while it runs."""
        status = self._process.poll()
        if status is not None:
            if self._process.stdin is not None:
                self._process.stdin.close()
            self._cores.free()
            self._gpu.free()
        return status

    def stop(self) -> None:
        """Asks it to save and end."""
        with suppress(ProcessLookupError):
            self._process.send_signal(signal.SIGTERM)


def worker_environment(threads: int | None, backend: str | None) -> dict[str, str]:
    """Returns the variables of a worker.

    XLA and BLAS split sums among their threads, so that the last bits of a result
    depend on their number: it is fixed, whichever machine a worker gets to, and so is
    what `fix_rounding` asks for.

    Args:
        threads: of a worker; as many as it finds cores if None.
        backend: physics backend; only Warp's workers look for a GPU.
    """
    here = str(Path(__file__).parents[4])
    path = os.pathsep.join(filter(None, (here, os.environ.get("PYTHONPATH", ""))))
    found = {"PYTHONPATH": path, "PYTHONUNBUFFERED": "1", "TF_CPP_MIN_LOG_LEVEL": "3"}
    found[XLA] = os.environ.get(XLA, "")
    fix_rounding(found)
    if backend != "warp":
        found["JAX_PLATFORMS"] = "cpu"
    if threads is not None:
        found |= dict.fromkeys(("PJRT_NPROC", "OMP_NUM_THREADS"), str(threads))
    return found
