"""A worker as a process: started with its own interpreter, read line by line."""

import json
import os
import re
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchmarks.comparison.peers import OURS, ROOT, python_of
from benchmarks.comparison.plan import SEED, Job, Worker
from benchmarks.comparison.workers.report import MARK

KEPT = 300
"""Characters of a failed worker's last words that its row repeats."""
CACHES = ("JAX_COMPILATION_CACHE_DIR", "FINGERS_COMPILE_CACHE")
"""Where compiled programs would be found again; a start is measured without."""


class FailedError(Exception):
    """A worker that ended without its figure; the message is its last words."""


@dataclass(frozen=True)
class Place:
    """Where a comparison keeps its things.

    Attributes:
        out: folder of rows, model and environments.
        device: `cpu` or `gpu`.
        here: whether peers are taken from this very environment.
        starts: of each worker whose start is measured, at most.
    """

    out: Path
    device: str
    here: bool = False
    starts: int = 3

    @property
    def mjcf(self) -> Path:
        """The standing hand that peers are given."""
        return self.out / "hand.xml"


class Speaker:
    """A running worker.

    Args:
        worker: what to run.
        job: for how many worlds.
        place: where.
        log: takes all that it says on its error stream.
    """

    def __init__(self, worker: Worker, job: Job, place: Place, log):
        environment = OURS if place.here else worker.environment
        python = python_of(environment, place.out / "environments")
        self.log, self.began_s = log, time.perf_counter()
        self._out = str(place.out)
        self.process = subprocess.Popen(
            [str(python), *words(worker, job, place)],
            cwd=ROOT,
            env=_environment(place),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )

    def ask(self, word: str) -> dict:
        """Sends a word and returns the answer."""
        assert self.process.stdin
        try:
            self.process.stdin.write(f"{word}\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            raise FailedError(self._last_words()) from None
        return self.hear()

    def hear(self) -> dict:
        """Returns the next message.

        Raises:
            FailedError: the worker ended.
        """
        assert self.process.stdout
        for line in self.process.stdout:
            if line.startswith(MARK):
                return json.loads(line.removeprefix(MARK))
        raise FailedError(self._last_words())

    def age_s(self) -> float:
        """Returns the time since the process was started [s]."""
        return time.perf_counter() - self.began_s

    def _last_words(self) -> str:
        self.process.wait()
        self.log.seek(0)
        text = self.log.read().replace(self._out, "DIR")
        said = [line.strip() for line in text.split("\n") if line.strip()]
        errors = [line for line in said if re.match(r"[\w.]*(Error|Exception):", line)]
        # The handler of an error may fail itself, and hide why.
        chained = any("During handling of the above" in line for line in said)
        last = ", after it ".join((errors or said or ["no word"])[-1 - int(chained) :])
        return f"exit status {self.process.returncode}: {last[:KEPT]}"


@contextmanager
def speaking(worker: Worker, job: Job, place: Place) -> Iterator[Speaker]:
    """Runs a worker and ends it afterwards, whatever happens."""
    with tempfile.TemporaryFile("w+", errors="replace") as log:
        speaker = Speaker(worker, job, place, log)
        try:
            yield speaker
        finally:
            speaker.process.kill()
            speaker.process.communicate()


def words(worker: Worker, job: Job, place: Place) -> list[str]:
    """Returns what follows the interpreter's name."""
    module = f"benchmarks.comparison.workers.{worker.module}"
    given = ["--worlds", str(job.worlds), "--seed", str(SEED)]
    given += ["--device", place.device, "--mjcf", str(place.mjcf)]
    own = place.out / "written" / job.name / worker.module
    return ["-m", module, *given, "--out", str(own), *worker.options]


def _environment(place: Place) -> dict[str, str]:
    given = {name: x for name, x in os.environ.items() if name not in CACHES}
    # Peers share the GPU's memory while they take turns.
    given |= {"XLA_PYTHON_CLIENT_PREALLOCATE": "false", "WANDB_MODE": "disabled"}
    return given | ({"CUDA_VISIBLE_DEVICES": ""} if place.device == "cpu" else {})
