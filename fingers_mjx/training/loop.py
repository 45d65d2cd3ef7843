"""The loop of a run: advance, look after health, log, save, stop."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from envs.config.typed import to_dict
from fingers_mjx.ppo.state import Carry
from fingers_mjx.ppo.totals import means
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.metrics import MetricsLog
from fingers_mjx.training.dump import dump_state
from fingers_mjx.training.errors import Diverged, Interrupted
from fingers_mjx.training.progress import OnProgress, Ticker
from fingers_mjx.training.room import overflows
from fingers_mjx.training.row import Window, speed
from fingers_mjx.training.session import Report, Session
from fingers_mjx.training.signals import StopSignals
from fingers_mjx.training.watchdog import Watchdog


@dataclass(frozen=True)
class Desk:
    """What the loop writes to and listens to.

    Attributes:
        path: run directory.
        bound: what a resumed run must share.
        env_config: settings of the task.
        log: learning curve.
        on_progress: told every event.
        stop: whether a signal asks the run to stop.
        watchdog: told that the run goes on.
        ticker: says "compiling" until the first call is done.
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


class Loop:
    """Drives a session from iteration to iteration.

    One call is always in flight while the next is prepared, so that the device does
    not wait for Python; its health is looked at before the call after it.

    Args:
        session: compiled training.
        desk: where everything goes.
        carry: state to start from.
        iteration: iterations done.
        trained_s: time spent on them [s].
        saved: checkpoint of that state, if it comes from one.
    """

    def __init__(
        self,
        session: Session,
        desk: Desk,
        carry: Carry,
        iteration: int,
        trained_s: float,
        saved: Path | None,
    ):
        self.session, self.desk, self.config = session, desk, session.config
        self.carry, self.iteration = carry, iteration
        self.saved = saved
        self._flying: Report | None = None
        self._flying_to = iteration
        self._window = Window()
        self._noted = -1
        self._calls = 0
        self._began_s = time.monotonic() - trained_s
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
            if self.desk.stop.requested:
                raise Interrupted(self._save(), self.iteration)
            if self._due(self.config.checkpoint_every):
                self._save()
        return self._save()

    def _due(self, every: int) -> bool:
        """Tells whether something done every so many iterations is due."""
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
            self.desk.ticker.stop()
        self._tick()

    def _tick(self) -> None:
        """Takes the time of a call and tells the watchdog that the run goes on."""
        now_s = time.monotonic()
        if self._calls > 1:
            self._window.time(now_s - self._mark_s, self.config.iterations_per_call)
        self._mark_s = now_s
        self.desk.watchdog.beat()

    def _land(self) -> None:
        """Waits for the call in flight and looks at its health."""
        if self._flying is None:
            return
        self._health = self._flying.fetch_health()
        if self.config.on_overflow == "stop":
            figures = means(self.session.names, self._flying.fetch_sums())
            self._tell_overflow(figures, f"iteration {self._flying_to}")
        self._flying = None
        if self._health["worst_streak"] >= self.config.ppo.max_bad_updates:
            raise self._divergence(self._health)

    def _tell_overflow(self, figures: Mapping[str, float], when: str) -> None:
        """Stops the run where contacts were dropped, or says so and goes on."""
        worlds, settings = self.config.num_envs, self.desk.env_config
        for error in overflows(figures, when, worlds, settings):
            if self.config.on_overflow == "stop":
                raise error
            self.desk.on_progress({"event": "note", "text": str(error)})

    def _divergence(self, health: Mapping[str, int]) -> Diverged:
        """Saves the state for inspection and returns the error that tells of it."""
        iteration = health["first_iteration"]
        name = f"diverged-{iteration:08d}.npz"
        dump = dump_state(self.desk.path / name, self.carry)
        good = checkpoint.checkpoints(self.desk.checkpoints)
        term = self.session.terms[health["first_term"]]
        streak = health["worst_streak"]
        return Diverged(term, iteration, streak, dump, good[-1] if good else None)

    def _log(self) -> None:
        """Fetches the figures since the last row and makes a row of them."""
        self._land()
        config, figures = self.config, self._window.figures(self.session.names)
        row = {
            "iteration": self.iteration,
            "iterations": config.iterations,
            "env_steps": self.iteration * config.steps_per_iteration,
            "time_s": time.time(),
            "elapsed_s": time.monotonic() - self._began_s,
            **speed(self._window, config, self.iteration),
            **figures,
            "updates_skipped": self._health["skipped"],
        }
        self._window = Window()
        self.desk.log.append(row)
        self.desk.on_progress({"event": "progress", **row})
        self._note_fault()
        self._tell_overflow(figures, "since the last row")

    def _note_fault(self) -> None:
        """Tells of the latest step that was set aside, once."""
        if self._health["fault_iteration"] > self._noted:
            self._noted = self._health["fault_iteration"]
            sentence = self.session.fault(self._health)
            self.desk.on_progress({"event": "note", "text": sentence})

    def _save(self) -> Path:
        """Writes a checkpoint of the present iteration, unless there is one."""
        self._land()
        if self.saved is None:
            meta = {
                "bound": self.desk.bound,
                "config": to_dict(self.config),
                "env_steps": self.iteration * self.config.steps_per_iteration,
                "trained_s": time.monotonic() - self._began_s,
            }
            directory, keep = self.desk.checkpoints, self.config.keep_checkpoints
            self.saved = checkpoint.save(
                directory, self.iteration, self.carry, meta, keep
            )
            event = {"event": "checkpoint", "path": str(self.saved)}
            self.desk.on_progress(event | {"iteration": self.iteration})
            self._mark_s = time.monotonic()
        return self.saved
