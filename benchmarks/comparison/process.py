"""A worker as a process: started with its own interpreter, read line by line."""

import json
import re
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.comparison.peers import OURS, ROOT, python_of
from benchmarks.comparison.place import FRESH, Place
from benchmarks.comparison.plan import SEED, Job, Worker
from benchmarks.comparison.workers.report import MARK

KEPT = 300
"""Characters of a failed worker's last words that its row repeats."""
LATE_S = 1.0
"""What a worker said in time is still read so long after its limit [s]."""


class FailedError(Exception):
    """A worker that ended without its figure; the message is its last words."""


class Speaker:
    """A running worker.

    Args:
        worker: what to run.
        job: for how many worlds.
        place: where.
        log: takes all that it says on its error stream.
        environment: variables that it is given.
    """

    def __init__(
        self, worker: Worker, job: Job, place: Place, log, environment: dict[str, str]
    ):
        peer = worker.environment if place.here is None else OURS
        python = python_of(peer, place.out / "environments")
        self.log, self.began_s = log, time.perf_counter()
        self._asked_s, self._limit_s, self._late = self.began_s, place.limit_s, False
        self._out = str(place.out)
        self.process = subprocess.Popen(
            [str(python), *words(worker, job, place)],
            cwd=ROOT,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )

    def ask(self, word: str) -> dict:
        """Sends a word and returns the answer."""
        assert self.process.stdin
        self._asked_s = time.perf_counter()
        try:
            self.process.stdin.write(f"{word}\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            raise FailedError(self._last_words()) from None
        return self.hear()

    def hear(self) -> dict:
        """Returns the next message.

        Raises:
            FailedError: the worker ended, or its limit is over.
        """
        assert self.process.stdout
        with self._limited():
            for line in self.process.stdout:
                if line.startswith(MARK):
                    return json.loads(line.removeprefix(MARK))
        if self._late:
            raise FailedError(f"no answer in {self._limit_s:g} s")
        raise FailedError(self._last_words())

    def age_s(self) -> float:
        """Returns the time since the process was started [s]."""
        return time.perf_counter() - self.began_s

    @contextmanager
    def _limited(self) -> Iterator[None]:
        """Kills the worker when its limit is over."""
        rest_s = self._asked_s + self._limit_s - time.perf_counter()
        if rest_s == float("inf"):
            yield
            return
        timer = threading.Timer(max(rest_s, LATE_S), self._give_up)
        timer.start()
        try:
            yield
        finally:
            timer.cancel()

    def _give_up(self) -> None:
        self._late = True
        self.process.kill()

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
    path = place.log(job, worker)
    path.parent.mkdir(parents=True, exist_ok=True)
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as fresh,
        path.open("w+", encoding="utf-8", errors="replace") as log,
    ):
        given = place.environment(worker)
        if job.kind in ("start", "learn"):
            given |= {name: str(Path(fresh, name)) for name in FRESH}
        speaker = Speaker(worker, job, place, log, given)
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
