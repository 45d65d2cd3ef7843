"""The training driver: from a configuration to a run directory, and on again."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from envs.base import VectorEnv
from envs.errors import InputError
from fingers_mjx.ppo.config import check_config, free_fields
from fingers_mjx.ppo.state import TrainState, strong, train_template
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.directory import check_bound, open_run, record_run
from fingers_mjx.runs.metrics import MetricsLog, read_metrics
from fingers_mjx.runs.setup import Setup
from fingers_mjx.training.compile_cache import use_compile_cache
from fingers_mjx.training.loop import Loop, LoopServices, StartPoint
from fingers_mjx.training.progress import OnProgress, Ticker
from fingers_mjx.training.schedules import steps_done, with_steps
from fingers_mjx.training.session import Session, bound
from fingers_mjx.training.signals import StopSignals
from fingers_mjx.training.warm_start import completed, started_from
from fingers_mjx.training.watchdog import Watchdog

TICK_S = 1.0
"""Time between two reports of compilation."""


@dataclass(frozen=True)
class Result:
    """What a finished run gave.

    Attributes:
        run_dir: directory of the run.
        checkpoint: last checkpoint.
        iterations: done in all.
        metrics: last row of the learning curve.
    """

    run_dir: Path
    checkpoint: Path
    iterations: int
    metrics: Mapping[str, Any]


@dataclass(frozen=True)
class Start:
    """How a run begins: afresh unless stated otherwise.

    Attributes:
        resume: go on from the newest intact checkpoint of the run directory.
        warm_start: run directory, checkpoint or bundle whose networks the new run
            starts from (`fingers_mjx.training.warm_start`); all else starts afresh.
        keep_schedules: curricula go on from the control steps that the run of
            `warm_start` has done (`fingers_mjx.training.schedules`).

    Raises:
        InputError: `warm_start` with `resume`, or `keep_schedules` without it.
    """

    resume: bool = False
    warm_start: Path | None = None
    keep_schedules: bool = False

    def __post_init__(self) -> None:
        if self.resume and self.warm_start:
            raise InputError("--warm-start", "", self.warm_start, "without --resume")
        if self.keep_schedules and not self.warm_start:
            raise InputError("--schedules", "", "keep", "with --warm-start RUN")


FRESH = Start()


def train(
    env: VectorEnv,
    setup: Setup,
    run_dir: Path,
    *,
    start: Start = FRESH,
    identity: Mapping[str, Any] | None = None,
    on_progress: OnProgress = lambda event: None,
) -> Result:
    """Trains until `setup.train.iterations` are done, and writes the run directory.

    Args:
        env: `setup.train.num_envs` worlds made from `setup`.
        setup: settings and hand, written to the run directory; a resumed run must
            share them, except for the fields that are free.
        run_dir: new or empty directory, or the one to resume.
        start: how the run begins.
        identity: JSON-able facts that a resumed run must share besides the settings
            (`fingers_mjx.policy.interface.identity`).
        on_progress: called with the events of `fingers_mjx.training.progress`, from
            any thread.

    Raises:
        InputError: for settings, directories or checkpoints that do not fit, or when
            contacts were dropped for lack of space (`TrainConfig.on_overflow`).
        Diverged: when too many updates in a row were not finite.
        Interrupted: after SIGINT or SIGTERM, with a checkpoint written.
        OutOfSpace: when the disk is full; earlier checkpoints are intact.
    """
    config = setup.train
    check_config(config)
    steps, learned = _counted(start), _learned(env, setup, start)
    use_compile_cache()

    def say(text: str) -> None:
        on_progress({"event": "note", "text": text})

    with (
        open_run(run_dir, start.resume) as path,
        StopSignals(say) as stop,
        Watchdog(path / "hang.txt", config.hang_limit_s) as watchdog,
        Ticker(on_progress, TICK_S) as ticker,
    ):
        shared = bound(env, setup, identity or {})
        if start.resume:
            check_bound(path, shared, {f"env.{x}" for x in free_fields(setup.env)})
        session = Session(env, config)
        newest = _newest(path, say) if start.resume else None
        begin = (
            _restored(session, newest) if newest else _fresh(session, learned, steps)
        )
        record_run(path, {"train": config, "env": setup.env}, shared, setup.hand)
        with MetricsLog(path, begin.iteration) as log:
            services = LoopServices(
                path, shared, setup.env, log, on_progress, stop, watchdog, ticker
            )
            saved = Loop(session, services, begin).run()
    rows = read_metrics(path / "metrics.jsonl")
    return Result(path, saved, int(saved.name), rows[-1])


def _learned(env: VectorEnv, setup: Setup, start: Start) -> TrainState | None:
    """Reads what a warm start brings, before anything is written."""
    if start.warm_start is None:
        return None
    return started_from(train_template(env, setup.train.ppo), env, start.warm_start)


def _counted(start: Start) -> int:
    """Reads from where schedules go on, before anything is written."""
    if start.warm_start is None or not start.keep_schedules:
        return 0
    return steps_done(start.warm_start)


def _newest(path: Path, say: Callable[[str], None]) -> Path | None:
    """Returns the newest intact checkpoint of a run, and puts away what is not."""
    directory = path / "checkpoints"
    checkpoint.clean(directory)
    newest = checkpoint.newest(directory, say)
    if newest is not None:
        checkpoint.set_aside(directory, int(newest.name))
        say(f"going on from {newest}")
    return newest


def _restored(session: Session, path: Path) -> StartPoint:
    """Returns the state saved at `path`."""
    saved = checkpoint.load(path)
    carry = strong(saved.into(session.template()))
    return StartPoint(carry, saved.iteration, saved.meta["trained_s"], path)


def _fresh(session: Session, learned: TrainState | None, steps: int) -> StartPoint:
    """Returns the state of a new run, with what was `learned` and counted elsewhere."""
    carry = session.start()
    if steps:
        carry = replace(carry, worlds=with_steps(carry.worlds, steps))
    if learned is not None:
        carry = replace(carry, train=strong(completed(learned, carry.train)))
    return StartPoint(carry)
