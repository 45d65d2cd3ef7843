"""The training driver: from a configuration to a run directory, and on again."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from envs.base import VectorEnv
from envs.errors import InputError
from envs.hand.hand_file import HandFile
from fingers_mjx.ppo.config import TrainConfig, free_fields
from fingers_mjx.ppo.config_check import check_config
from fingers_mjx.ppo.state import Carry, strong
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.directory import check_bound, open_run, record_run
from fingers_mjx.runs.metrics import MetricsLog, read_metrics
from fingers_mjx.training.compile_cache import use_compile_cache
from fingers_mjx.training.loop import Desk, Loop
from fingers_mjx.training.progress import OnProgress, Ticker
from fingers_mjx.training.session import Session, bound
from fingers_mjx.training.signals import StopSignals
from fingers_mjx.training.warm_start import started_from
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


def train(
    make_env: Callable[[int], VectorEnv],
    config: TrainConfig,
    run_dir: Path,
    *,
    env_config: Any = None,
    hand: HandFile | None = None,
    resume: bool = False,
    warm_start: Path | None = None,
    identity: Mapping[str, Any] | None = None,
    on_progress: OnProgress = lambda event: None,
) -> Result:
    """Trains until `config.iterations` are done, and writes the run directory.

    Args:
        make_env: number of worlds -> batched environment.
        config: of the run; for a resumed one, as saved (`rundir.saved_config`).
        run_dir: new or empty directory, or with `resume` that of the run.
        env_config: configuration of the environment, a dataclass or mapping; written
            beside `config`, and a resumed run must share it.
        hand: written beside both.
        resume: go on from the newest intact checkpoint.
        warm_start: run directory, checkpoint or bundle whose networks the new run
            starts from (`fingers_mjx.training.warm_start`); all else starts afresh.
        identity: JSON-able facts that a resumed run must share besides configuration
            and sizes, such as the hash of the model and the order of observations.
        on_progress: gets the events of `fingers_mjx.training.progress`, from any
            thread.

    Raises:
        InputError: for settings, directories or checkpoints that do not fit, or when
            contacts were dropped for want of room (`TrainConfig.on_overflow`).
        Diverged: when too many updates in a row were not finite.
        Interrupted: after SIGINT or SIGTERM, with a checkpoint written.
        OutOfSpace: when the disk is full; earlier checkpoints are intact.
    """
    check_config(config)
    if resume and warm_start:
        raise InputError("--warm-start", "", warm_start, "without --resume")
    use_compile_cache()

    def say(text: str) -> None:
        on_progress({"event": "note", "text": text})

    with (
        open_run(run_dir, resume) as path,
        StopSignals(say) as stop,
        Watchdog(path / "hang.txt", config.hang_limit_s) as watchdog,
        Ticker(on_progress, TICK_S) as ticker,
    ):
        env = make_env(config.num_envs)
        shared = bound(env, config, env_config, identity or {})
        if resume:
            free = {f"env.{name}" for name in free_fields(env_config)}
            check_bound(path, shared, free)
        session = Session(env, config)
        newest = _newest(path, say) if resume else None
        start = _restored(session, newest) if newest else _fresh(session, warm_start)
        record_run(path, {"train": config, "env": env_config}, shared, hand)
        with MetricsLog(path, start[1]) as log:
            desk = Desk(
                path, shared, env_config, log, on_progress, stop, watchdog, ticker
            )
            saved = Loop(session, desk, *start, saved=newest).run()
    rows = read_metrics(path / "metrics.jsonl")
    return Result(path, saved, int(saved.name), rows[-1])


def _newest(path: Path, say: Callable[[str], None]) -> Path | None:
    """Returns the newest intact checkpoint of a run, and puts away what is not."""
    directory = path / "checkpoints"
    checkpoint.clean(directory)
    newest = checkpoint.newest(directory, say)
    if newest is not None:
        checkpoint.set_aside(directory, int(newest.name))
        say(f"going on from {newest}")
    return newest


def _restored(session: Session, path: Path) -> tuple[Carry, int, float]:
    """Returns the state saved at `path`, the iterations done and the time they took."""
    saved = checkpoint.load(path)
    carry = strong(saved.into(session.template()))
    return carry, saved.iteration, saved.meta["trained_s"]


def _fresh(session: Session, warm_start: Path | None) -> tuple[Carry, int, float]:
    """Returns the state of a new run, with the networks of `warm_start` if given."""
    carry = session.start()
    if warm_start is not None:
        started = started_from(carry.train, session.env, warm_start)
        carry = replace(carry, train=strong(started))
    return carry, 0, 0.0
