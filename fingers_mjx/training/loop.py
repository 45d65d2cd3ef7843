"""The loop of a run: advance, check health, log, save, stop."""

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from envs.config.typed import to_dict
from envs.errors import InputError
from envs.physics.room import ROOM, too_little_room
from fingers_mjx.ppo.state import Carry
from fingers_mjx.ppo.totals import means
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.metrics import MetricsLog
from fingers_mjx.training.dump import dump_state
from fingers_mjx.training.errors import Diverged, Interrupted
from fingers_mjx.training.progress import OnProgress, Ticker
from fingers_mjx.training.row import Window, speed
from fingers_mjx.training.session import Report, Session
from fingers_mjx.training.signals import StopSignals
from fingers_mjx.training.watchdog import Watchdog

GO_ON = ", or on_overflow=warn to go on without them; either also with --resume"


@dataclass(frozen=True)
class LoopServices:
    """Where the loop writes to and what it listens to.

    Attributes:
        path: run directory.
        bound: what a resumed run must share.
        env_config: settings of the task.
        log: learning curve.
        on_progress: called with every event.
        stop: whether a signal asks the run to stop.
        watchdog: ends a run that no longer advances.
        ticker: reports "compiling" until the first call is done.
    """

    path: Path
    bound: Mapping[str, Any]
    env_config: Any
    log: MetricsLog
    on_progress: OnProgress
    stop: StopSignals
    watchdog: Watchdog
    ticker: Ticker

    @property
    def checkpoints(self) -> Path:
        """Directory of the checkpoints."""
        return self.path / "checkpoints"

    def note(self, sentence: str) -> None:
        """Reports a sentence for the user."""
        self.on_progress({"event": "note", "text": sentence})


@dataclass(frozen=True)
class StartPoint:
    """State from which the loop goes on.

    Attributes:
        carry: state of the run.
        iteration: iterations done.
        trained_s: time spent on them [s].
        saved: checkpoint of that state, if it comes from one.
    """

    carry: Carry
    iteration: int = 0
    trained_s: float = 0.0
    saved: Path | None = None


class Loop:
    """Drives a session from iteration to iteration.

    One call is always in flight while the next is prepared, so that the device does
    not wait for Python; its health is examined before the call after it.
    """

    def __init__(self, session: Session, services: LoopServices, start: StartPoint):
        self.session, self.services, self.config = session, services, session.config
        self.carry, self.iteration = start.carry, start.iteration
        self.saved = start.saved
        self._flying: Report | None = None
        self._flying_to = start.iteration
        self._window = Window()
        self._noted = -1
        self._calls = 0
        self._began_s = time.monotonic() - start.trained_s
        self._mark_s = time.monotonic()

    def run(self) -> Path:
        """Trains to the end and returns the last checkpoint.

        Raises:
            Diverged: when too many updates in a row were not finite.
            InputError: when contacts were dropped and `on_overflow` is "stop".
            Interrupted: when a signal asked for it; a checkpoint has been written.
            OutOfSpace: when the disk is full.
        """
        while self.iteration < self.config.iterations:
            self._advance()
            if self._due(self.config.log_every):
                self._log()
            if self.services.stop.requested:
                raise Interrupted(self._save(), self.iteration)
            if self._due(self.config.checkpoint_every):
                self._save()
        return self._save()

    def _due(self, every: int) -> bool:
        """Whether something done every so many iterations is due."""
        return self.iteration % every == 0 or self.iteration == self.config.iterations

    def _advance(self) -> None:
        """Starts one call and waits for the one before (the first: for itself)."""
        self.carry, report = self.session.advance(self.carry)
        self.iteration += self.config.iterations_per_call
        self._window.sums.append(report.sums)
        self.saved = None
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
        """Waits for the call in flight and examines its health."""
        if self._flying is None:
            return
        self._health = self._flying.fetch_health()
        if self.config.on_overflow == "stop":
            metrics = means(self.session.names, self._flying.fetch_sums())
            self._report_overflow(metrics, f"iteration {self._flying_to}")
        self._flying = None
        if self._health["worst_streak"] >= self.config.ppo.max_bad_updates:
            raise self._divergence(self._health)

    def _report_overflow(self, metrics: Mapping[str, float], when: str) -> None:
        """Stops the run where contacts were dropped, or notes it and goes on."""
        worlds, settings = self.config.num_envs, self.services.env_config
        for error in _overflows(metrics, when, worlds, settings):
            if self.config.on_overflow == "stop":
                raise error
            self.services.note(str(error))

    def _divergence(self, health: Mapping[str, int]) -> Diverged:
        """Saves the state for inspection and returns the error that names it."""
        iteration = health["first_iteration"]
        name = f"diverged-{iteration:08d}.npz"
        dump = dump_state(self.services.path / name, self.carry)
        good = checkpoint.checkpoints(self.services.checkpoints)
        term = self.session.terms[health["first_term"]]
        streak = health["worst_streak"]
        return Diverged(term, iteration, streak, dump, good[-1] if good else None)

    def _log(self) -> None:
        """Fetches the metrics since the last row and appends their means."""
        self._land()
        config, metrics = self.config, self._window.means(self.session.names)
        row = {
            "iteration": self.iteration,
            "iterations": config.iterations,
            "env_steps": self.iteration * config.steps_per_iteration,
            "time_s": time.time(),
            "elapsed_s": time.monotonic() - self._began_s,
            **speed(self._window, config, self.iteration),
            **metrics,
            "updates_skipped": self._health["skipped"],
        }
        self._window = Window()
        self.services.log.append(row)
        self.services.on_progress({"event": "progress", **row})
        self._note_fault()
        self._report_overflow(metrics, "since the last row")

    def _note_fault(self) -> None:
        """Reports the latest step that was set aside, once."""
        if self._health["fault_iteration"] > self._noted:
            self._noted = self._health["fault_iteration"]
            self.services.note(self.session.fault(self._health))

    def _save(self) -> Path:
        """Writes a checkpoint of the present iteration, unless there is one."""
        self._land()
        if self.saved is None:
            meta = {
                "bound": self.services.bound,
                "config": to_dict(self.config),
                "env_steps": self.iteration * self.config.steps_per_iteration,
                "trained_s": time.monotonic() - self._began_s,
            }
            directory, keep = self.services.checkpoints, self.config.keep_checkpoints
            self.saved = checkpoint.save(
                directory, self.iteration, self.carry, meta, keep
            )
            event = {"event": "checkpoint", "path": str(self.saved)}
            self.services.on_progress(event | {"iteration": self.iteration})
            self._mark_s = time.monotonic()
        return self.saved


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
