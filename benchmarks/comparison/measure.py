"""The three kinds of measurement: by turns, from the start, and as reported."""

import dataclasses
from collections.abc import Callable

from benchmarks.comparison.figures import Figure, Found, interval, none
from benchmarks.comparison.peers import CannotInstallError
from benchmarks.comparison.place import Place
from benchmarks.comparison.plan import Job
from benchmarks.comparison.process import FailedError, speaking
from benchmarks.comparison.rows import Row
from benchmarks.comparison.turns import by_turns


def measure(job: Job, place: Place) -> Found:
    """Measures a job and returns what was found of each of its workers."""
    return _KINDS[job.kind](job, place)


def _turns(job: Job, place: Place) -> Found:
    """Rates of workers that take turns."""
    return next(found for _, found in by_turns([job], place))


def _start(job: Job, place: Place) -> Found:
    """Seconds from the start of a process to its message, by turns."""
    seconds: dict[int, list[float]] = {i: [] for i in range(len(job.workers))}
    about: dict[int, dict] = {}
    failed: dict[int, str] = {}
    for _ in range(min(job.starts, place.starts)):
        for index, worker in enumerate(job.workers):
            if index in failed:
                continue
            try:
                with speaking(worker, job, place) as speaker:
                    about[index] = speaker.hear()
                    seconds[index].append(speaker.age_s())
            except (FailedError, CannotInstallError) as error:
                failed[index] = str(error)
                continue
            print(f"{job.name}: {worker.peer} {seconds[index][-1]:.1f} s", flush=True)
    found = []
    for index, worker in enumerate(job.workers):
        if index in failed:
            found.append((worker, none(job.quantity, "s", failed[index])))
            continue
        figures = (*interval(seconds[index]), *_said(about[index]))
        found.append((worker, Figure(job.quantity, "s", *figures)))
    return found


def _report(job: Job, place: Place) -> Found:
    """Figures that workers name themselves, until they say `done`."""
    found: Found = []
    for worker in job.workers:
        print(f"{job.name}: {worker.peer}", flush=True)
        try:
            with speaking(worker, job, place) as speaker:
                while not (said := speaker.hear()).get("done"):
                    peer = said.get("peer", worker.peer)
                    found.append(
                        (dataclasses.replace(worker, peer=peer), _figure(said))
                    )
        except (FailedError, CannotInstallError) as error:
            found.append((worker, none(job.quantity, "", str(error))))
    return found


def rows(job: Job, found: Found, **shared) -> list[Row]:
    """Returns the rows of a job; `shared` holds command, seed, device and commit."""
    return [
        Row(job.name, worker.peer, **vars(figure), **shared) for worker, figure in found
    ]


def _figure(said: dict) -> Figure:
    value, low, high = (said.get(name) for name in ("value", "low", "high"))
    figures = (said["unit"], value, low, high, *_said(said))
    return Figure(said["quantity"], *figures)


def _said(said: dict) -> tuple[str, str]:
    return said["version"], said["note"]


_KINDS: dict[str, Callable[[Job, Place], Found]] = {
    "turns": _turns,
    "start": _start,
    "report": _report,
    "learn": _report,
}
