"""The parent of a sweep: starts workers, notes how they end, and stops when asked."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fingers_mjx.runs.directory import locked
from fingers_mjx.runs.files import OutOfSpace
from fingers_mjx.studies.sweep.book import Book
from fingers_mjx.studies.sweep.engines.engine import Engine, Job
from fingers_mjx.studies.sweep.manifest import Manifest, number_of
from fingers_mjx.studies.sweep.outcome import outcome
from fingers_mjx.studies.sweep.plan import Key
from fingers_mjx.studies.sweep.promote import promoted
from fingers_mjx.studies.sweep.resolve import LOCK_FILE
from fingers_mjx.training.errors import Interrupted
from fingers_mjx.training.signals import StopSignals

POLL_S = 0.1


class SweepStopped(RuntimeError):
    """A signal stopped the sweep (status 75)."""

    exit_code = Interrupted.exit_code


class SweepFull(RuntimeError):
    """The disk is full, which stops the sweep (status 4)."""

    exit_code = OutOfSpace.exit_code


@contextmanager
def sweep_lock(root: Path) -> Iterator[None]:
    """Makes the directory of a sweep and holds it.

    Raises:
        InputError: another process works on the sweep.
    """
    root.mkdir(parents=True, exist_ok=True)
    with locked(root / LOCK_FILE, "a sweep on which no other process works"):
        yield


@dataclass
class _Running:
    """Workers of a sweep.

    Attributes:
        jobs: those that run, with their members.
        stopping: whether they have been asked to save and end.
        full: what a worker said of a full disk.
    """

    jobs: list[tuple[tuple[Key, ...], Job]] = field(default_factory=list)
    stopping: bool = False
    full: str = ""

    def stop(self) -> None:
        """Asks all workers to save and end, once."""
        if not self.stopping:
            self.stopping = True
            for _, job in self.jobs:
                job.stop()


def run_sweep(
    book: Book, engine: Engine, on_progress: Callable[[Mapping[str, Any]], None]
) -> Manifest:
    """Trains and evaluates all members that wait, and those that promotion adds.

    Args:
        book: of the sweep, whose directory is locked (`sweep_lock`).
        engine: where.
        on_progress: called with events `{"event": "note", "text": …}`, from any thread.

    Returns:
        The manifest at the end; members that failed or diverged are in it.

    Raises:
        SweepStopped: a signal came; workers have saved and ended.
        SweepFull: the disk is full; workers have ended.
        InputError: promotion by a measure that there is not.
    """

    def say(text: str) -> None:
        on_progress({"event": "note", "text": text})

    with StopSignals(say) as stop:
        try:
            _finish(book, engine, stop)
            if _promotable(book, say) and book.add(
                promoted(book.spec, book.root, book.manifest)
            ):
                _finish(book, engine, stop)
        finally:
            engine.close()
    return book.manifest


def _promotable(book: Book, say: Callable[[str], None]) -> bool:
    """Whether all that promotion goes by is there."""
    if book.spec.promote is None:
        return False
    lacking = [m for m in book.manifest.missing() if m.state != "diverged"]
    if lacking:
        say("no promotion: it waits for the members that are missing")
    return not lacking


def _finish(book: Book, engine: Engine, stop: StopSignals) -> None:
    """Starts workers until no member waits and none runs."""
    running = _Running()
    while True:
        if stop.requested:
            running.stop()
        while not running.stopping and len(running.jobs) < engine.slots:
            if not (waiting := book.waiting()):
                break
            group = engine.choose(waiting, book.failures)
            book.started(group)
            running.jobs.append((group, engine.launch(group)))
        if not running.jobs:
            break
        _note_ended(book, running)
        time.sleep(POLL_S)
    if running.full:
        raise SweepFull(running.full)
    if running.stopping:
        raise SweepStopped(_stopped(book))


def _note_ended(book: Book, running: _Running) -> None:
    """Notes the members whose workers have ended; a full disk stops the others."""
    for group, job in list(running.jobs):
        if (status := job.poll()) is None:
            continue
        running.jobs.remove((group, job))
        for key in group:
            run = book.root / book.member(key).run
            found = outcome(book.root, key, run, status, book.spec.repeatable)
            book.ended(key, found, running.stopping)
            if found.verdict == "full":
                running.full = found.reason
                running.stop()


def _stopped(book: Book) -> str:
    number = len(book.manifest.members)
    done = number - len(book.manifest.missing())
    return f"stopped with {done} of {number_of(number)} done; the same command goes on"
