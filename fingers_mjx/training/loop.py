"""The loop of a run or a population: advance, check health, log, save, stop."""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from envs.errors import InputError
from envs.physics.room import ROOM, too_little_room
from fingers_mjx.ppo.state import Carry
from fingers_mjx.ppo.totals import means
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.metrics import MetricsLog
from fingers_mjx.training.dump import dump_state
from fingers_mjx.training.errors import Diverged, Interrupted
from fingers_mjx.training.films import Films
from fingers_mjx.training.member import Place
from fingers_mjx.training.progress import OnProgress, Ticker
from fingers_mjx.training.row import Window, speed
from fingers_mjx.training.session import Report, Session
from fingers_mjx.training.signals import StopSignals
from fingers_mjx.training.watchdog import Watchdog

GO_ON = ", or on_overflow=warn to go on without them; either also with --resume"


@dataclass(frozen=True)
class LoopServices:
    """What the loop reports to and listens to.

    Attributes:
        places: of the members' files.
        logs: learning curves of the members.
        on_progress: called with every event.
        stop: whether a signal asks the run to stop.
        films: videos of the members.
        watchdog: ends a run that no longer advances.
        ticker: reports "compiling" until the first call is done.
    """

    places: Sequence[Place]
    logs: Sequence[MetricsLog]
    on_progress: OnProgress
    stop: StopSignals
    films: Films
    watchdog: Watchdog
    ticker: Ticker


@dataclass(frozen=True)
class StartPoint:
    """State from which the loop goes on.

    Attributes:
        carry: state of all members.
        iteration: iterations done.
        trained_s: time spent on them [s].
        saved: checkpoint of that state of each member, None where there is none.
        ended: why a member no longer learns, None where it does.
    """

    carry: Carry
    iteration: int
    trained_s: float
    saved: Sequence[Path | None]
    ended: Sequence[Diverged | None]


class Loop:
    """Drives a session from iteration to iteration.

    One call is always in flight while the next is prepared, so that the device does
    not wait for Python; its health is examined before the call after it. A member that
    diverges no longer changes (`fingers_mjx.ppo.iteration`) and writes no more files;
    the others go on.
    """

    def __init__(self, session: Session, services: LoopServices, start: StartPoint):
        self.session, self.services = session, services
        self.config = session.setups[0].train
        self.carry, self.iteration = start.carry, start.iteration
        self.saved: list[Path | None] = list(start.saved)
        self.ended: list[Diverged | None] = list(start.ended)
        self._flying: Report | None = None
        self._flying_to = start.iteration
        self._window = Window()
        self._noted = [-1] * session.members
        self._calls = 0
        self._began_s = time.monotonic() - start.trained_s
        self._mark_s = time.monotonic()

    def run(self) -> list[Diverged | None]:
        """Trains to the end, with a checkpoint there, and returns who diverged.

        Raises:
            InputError: when contacts were dropped and `on_overflow` is "stop".
            Interrupted: when a signal asked for it; a checkpoint has been written.
            OutOfSpace: when the disk is full.
        """
        while self.iteration < self.config.iterations and not all(self.ended):
            self._advance()
            if self._due(self.config.log_every):
                self._log()
            if self.services.stop.requested:
                raise Interrupted(self._save(), self.iteration)
            if self._due(self.config.checkpoint_every):
                self._save()
            self._film()
        self._save()
        self.services.films.finish()
        return self.ended

    def _film(self) -> None:
        """Begins a video that is due and takes in one that is done."""
        films = self.services.films
        films.collect()
        if films.due(self.iteration):
            self._land()
            films.start(self.session.split(self.carry), self.iteration)
            self._mark_s = time.monotonic()

    def _due(self, every: int) -> bool:
        """Whether something done every so many iterations is due."""
        return self.iteration % every == 0 or self.iteration == self.config.iterations

    def _advance(self) -> None:
        """Starts one call and waits for the one before (the first: for itself)."""
        self.carry, report = self.session.advance(self.carry)
        self.iteration += self.config.iterations_per_call
        self._window.sums.append(report.sums)
        self.saved = [None] * len(self.saved)
        self._land()
        self._flying, self._flying_to = report, self.iteration
        self._calls += 1
        if self._calls == 1:
            self._land()
            self.services.ticker.stop()
        self._tick()

    def _tick(self) -> None:
        """Takes the time of a call and resets the watchdog."""
        now_s = time.monotonic()
        if self._calls > 1:
            self._window.time(now_s - self._mark_s, self.config.iterations_per_call)
        self._mark_s = now_s
        self.services.watchdog.beat()

    def _land(self) -> None:
        """Waits for the call in flight and examines the health of its members."""
        if self._flying is None:
            return
        report, self._flying = self._flying, None
        self._health = report.fetch_health()
        if self.config.on_overflow == "stop":
            for index, sums in enumerate(report.fetch_sums()):
                metrics = means(self.session.names, sums)
                self._report_overflow(index, metrics, f"iteration {self._flying_to}")
        for index, health in enumerate(self._health):
            bad = health["worst_streak"] >= self.config.ppo.max_bad_updates
            if bad and self.ended[index] is None:
                self.ended[index] = self._divergence(index, health)

    def _report_overflow(
        self, index: int, metrics: Mapping[str, float], when: str
    ) -> None:
        """Stops the run where contacts were dropped, or notes it and goes on."""
        place, worlds = self.services.places[index], self.config.num_envs
        for error in _overflows(metrics, place.named(when), worlds, place.setup.env):
            if self.config.on_overflow == "stop":
                raise error
            self._note(place, str(error))

    def _divergence(self, index: int, health: Mapping[str, int]) -> Diverged:
        """Saves a member's state for inspection; returns the error that names it."""
        place, carry = self.services.places[index], self.session.split(self.carry)
        iteration = health["first_iteration"]
        dump = dump_state(place.path / f"diverged-{iteration:08d}.npz", carry[index])
        good = checkpoint.checkpoints(place.checkpoints)
        term = self.session.terms[health["first_term"]]
        streak = health["worst_streak"]
        error = Diverged(term, iteration, streak, dump, good[-1] if good else None)
        place.note_end(error)
        if self.session.members > 1:
            self._note(place, place.named(str(error)))
        return error

    def _log(self) -> None:
        """Fetches the metrics since the last row and appends their means."""
        self._land()
        sums = self._window.total()
        common = {
            "iteration": self.iteration,
            "iterations": self.config.iterations,
            "env_steps": self.iteration * self.config.steps_per_iteration,
            "time_s": time.time(),
            "elapsed_s": time.monotonic() - self._began_s,
            **speed(self._window, self.config, self.iteration),
        }
        self._window = Window()
        for index, place in enumerate(self.services.places):
            if self.ended[index] is None:
                metrics = dict(means(self.session.names, sums[index]))
                self._log_member(index, place, {**common, **metrics})

    def _log_member(self, index: int, place: Place, row: dict[str, Any]) -> None:
        """Appends the row of one member and reports what happened in it."""
        health = self._health[index]
        row["updates_skipped"] = health["skipped"]
        self.services.logs[index].append(row)
        self.services.on_progress({"event": "progress", **place.label, **row})
        if health["fault_iteration"] > self._noted[index]:
            self._noted[index] = health["fault_iteration"]
            self._note(place, place.named(self.session.fault(health)))
        self._report_overflow(index, row, "since the last row")

    def _note(self, place: Place, sentence: str) -> None:
        """Reports a sentence for the user."""
        self.services.on_progress({"event": "note", **place.label, "text": sentence})

    def _save(self) -> Path:
        """Writes the checkpoints of the present iteration that are missing.

        Of a population one more is kept: killed between two members, all still have
        the one before.
        """
        self._land()
        keep = self.config.keep_checkpoints + (self.session.members > 1)
        live = [i for i, error in enumerate(self.ended) if error is None]
        if any(self.saved[index] is None for index in live):
            carries = self.session.split(self.carry)
            for index in live:
                self.saved[index] = self._save_member(index, carries[index], keep)
            self._mark_s = time.monotonic()
        return next(path for path in [*self.saved, Path()] if path is not None)

    def _save_member(self, index: int, carry: Carry, keep: int) -> Path:
        """Writes the checkpoint of one member and returns its path."""
        place, trained_s = self.services.places[index], time.monotonic() - self._began_s
        saved = place.save(carry, self.iteration, trained_s, keep)
        event = {"event": "checkpoint", **place.label, "path": str(saved)}
        self.services.on_progress(event | {"iteration": self.iteration})
        return saved


def _overflows(
    metrics: Mapping[str, float], when: str, num_envs: int, config: Any
) -> Iterator[InputError]:
    """Yields an error for each buffer that was too small.

    Args:
        metrics: of one or more iterations, see `fingers_mjx.training.row`.
        when: the iterations, for the sentence.
        num_envs: worlds of the run.
        config: settings of the task.
    """
    for metric in ROOM:
        if worlds := math.ceil(metrics.get(f"{metric}_worlds", 0.0)):
            what = metric.removesuffix("_overflow")
            source = f"{when}: {what}s dropped in {worlds} of {num_envs} worlds"
            yield too_little_room(source, metric, config, GO_ON)
