"""The three kinds of measurement: by turns, from the start, and as reported."""

import dataclasses
import math
import statistics
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass

from scipy import stats

from benchmarks.comparison.peers import CannotInstallError
from benchmarks.comparison.plan import Job, Worker
from benchmarks.comparison.process import FailedError, Place, Speaker, speaking
from benchmarks.comparison.rows import Row

ROUNDS, STARTS = 7, 3
LEVEL = 0.95


@dataclass(frozen=True)
class Figure:
    """What was found of one worker; `value` is None where `note` says why."""

    quantity: str
    unit: str
    value: float | None
    low: float | None
    high: float | None
    version: str
    note: str


Found = list[tuple[Worker, Figure]]


def measure(job: Job, place: Place) -> Found:
    """Measures a job and returns what was found of each of its workers."""
    return _KINDS[job.kind](job, place)


def interval(values: list[float]) -> tuple[float, float, float]:
    """Returns the geometric mean of positive figures and its interval of 95 %.

    Source:
        Student's t interval of the logarithms.
    """
    logs = [math.log(x) for x in values]
    middle = statistics.mean(logs)
    if len(logs) < 2:
        return math.exp(middle), math.exp(middle), math.exp(middle)
    error = statistics.stdev(logs) / math.sqrt(len(logs))
    half = float(stats.t.ppf(0.5 + LEVEL / 2, len(logs) - 1)) * error
    return math.exp(middle), math.exp(middle - half), math.exp(middle + half)


def _turns(job: Job, place: Place) -> Found:
    """Rates of workers that take turns, so that other work hits them alike.

    The ratio of each to the first is taken round by round.
    """
    rates: dict[int, list[float]] = {}
    about: dict[int, dict] = {}
    failed: dict[int, str] = {}
    with ExitStack() as stack:
        running: dict[int, Speaker] = {}
        for index, worker in enumerate(job.workers):
            print(f"{job.name}: {worker.peer} gets ready", flush=True)
            try:
                speaker = stack.enter_context(speaking(worker, job, place))
                about[index], rates[index] = speaker.hear(), []
                running[index] = speaker
            except (FailedError, CannotInstallError) as error:
                failed[index] = str(error)
        for _ in range(ROUNDS):
            for index, speaker in list(running.items()):
                try:
                    rates[index].append(speaker.ask("go")["rate"])
                except FailedError as error:
                    failed[index] = str(error)
                    del running[index]
    found = []
    for index, worker in enumerate(job.workers):
        if index in failed:
            found.append((worker, _none(job.quantity, "steps/s", failed[index])))
            continue
        version, note = about[index]["version"], about[index]["note"]
        figures = (*interval(rates[index]), version, note)
        found.append((worker, Figure(job.quantity, "steps/s", *figures)))
        if index and 0 in about and 0 not in failed:
            pairs = zip(rates[index], rates[0], strict=True)
            ratio = interval([theirs / first for theirs, first in pairs])
            what = f"rate of {job.workers[0].peer} = 1"
            found.append((worker, Figure(what, "ratio", *ratio, version, note)))
    return found


def _start(job: Job, place: Place) -> Found:
    """Seconds from the start of a process to its message, by turns."""
    seconds: dict[int, list[float]] = {i: [] for i in range(len(job.workers))}
    about: dict[int, dict] = {}
    failed: dict[int, str] = {}
    for _ in range(STARTS):
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
            found.append((worker, _none(job.quantity, "s", failed[index])))
            continue
        figures = (*interval(seconds[index]), *_said(about[index]))
        found.append((worker, Figure(job.quantity, "s", *figures)))
    return found


def _report(job: Job, place: Place) -> Found:
    """Figures that workers name themselves with their peers, until they say `done`."""
    found: Found = []
    for worker in job.workers:
        print(f"{job.name}: {worker.peer}", flush=True)
        try:
            with speaking(worker, job, place) as speaker:
                while not (said := speaker.hear()).get("done"):
                    peer = dataclasses.replace(worker, peer=said["peer"])
                    found.append((peer, _figure(said)))
        except (FailedError, CannotInstallError) as error:
            found.append((worker, _none(job.quantity, "", str(error))))
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


def _none(quantity: str, unit: str, why: str) -> Figure:
    return Figure(quantity, unit, None, None, None, "", f"not measured: {why}")


_KINDS: dict[str, Callable[[Job, Place], Found]] = {
    "turns": _turns,
    "start": _start,
    "report": _report,
}
