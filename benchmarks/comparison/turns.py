"""Rates by turns: workers are readied side by side and timed one after another."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack

from benchmarks.comparison.figures import Figure, Found, interval, none
from benchmarks.comparison.peers import CannotInstallError
from benchmarks.comparison.place import Place
from benchmarks.comparison.plan import Job
from benchmarks.comparison.process import FailedError, Speaker, speaking

ROUNDS = 7


class Crew:
    """Workers of one job that take turns, so that other work hits them alike.

    Args:
        job: what they measure.
        place: where.

    Attributes:
        running: workers that still answer, by their place in the job.
        failed: last words of the others.
    """

    def __init__(self, job: Job, place: Place):
        self.job = job
        self.running: dict[int, Speaker] = {}
        self.failed: dict[int, str] = {}
        self._about: dict[int, dict] = {}
        self._open = ExitStack()
        for index, worker in enumerate(job.workers):
            print(f"{job.name}: {worker.peer} gets ready", flush=True)
            try:
                started = self._open.enter_context(speaking(worker, job, place))
                self.running[index] = started
            except (FailedError, CannotInstallError) as error:
                self.failed[index] = str(error)

    def get_ready(self) -> None:
        """Waits until each worker is ready or has ended."""
        for index, speaker in list(self.running.items()):
            try:
                self._about[index] = speaker.hear()
            except FailedError as error:
                self._drop(index, error)

    def found(self) -> Found:
        """Measures all rounds; the ratio of each to the first is taken round by round.

        Returns:
            For each worker its rate, and behind it the ratio.
        """
        rates = self._rates()
        found: Found = []
        for index, worker in enumerate(self.job.workers):
            if index in self.failed:
                why = none(self.job.quantity, "steps/s", self.failed[index])
                found.append((worker, why))
                continue
            said = (self._about[index]["version"], self._about[index]["note"])
            figures = (*interval(rates[index]), *said)
            found.append((worker, Figure(self.job.quantity, "steps/s", *figures)))
            if index and 0 not in self.failed:
                pairs = zip(rates[index], rates[0], strict=True)
                ratio = interval([theirs / first for theirs, first in pairs])
                what = f"rate of {self.job.workers[0].peer} = 1"
                found.append((worker, Figure(what, "ratio", *ratio, *said)))
        return found

    def end(self) -> None:
        """Ends all workers."""
        self._open.close()

    def _rates(self) -> dict[int, list[float]]:
        rates: dict[int, list[float]] = {index: [] for index in self.running}
        for _ in range(ROUNDS):
            for index, speaker in list(self.running.items()):
                try:
                    rates[index].append(speaker.ask("go")["rate"])
                except FailedError as error:
                    self._drop(index, error)
        return rates

    def _drop(self, index: int, error: FailedError) -> None:
        self.failed[index] = str(error)
        del self.running[index]


def by_turns(jobs: Sequence[Job], place: Place) -> Iterator[tuple[Job, Found]]:
    """Starts the workers of all `jobs` at once, then measures job after job.

    No worker is timed before all are ready.
    """
    crews: list[Crew] = []
    try:
        crews.extend(Crew(job, place) for job in jobs)
        for crew in crews:
            crew.get_ready()
        for crew in crews:
            yield crew.job, crew.found()
            crew.end()
    finally:
        for crew in crews:
            crew.end()
