"""The training driver: from configurations to run directories, and on again."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from envs.base import VectorEnv
from fingers_mjx.ppo.config import check_config
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.directory import END_FILE, check_bound, open_run, record_run
from fingers_mjx.runs.loggers.base import Open
from fingers_mjx.runs.loggers.choice import check_installed, chosen
from fingers_mjx.runs.metrics import MetricsLog, read_metrics
from fingers_mjx.runs.settings import free_settings
from fingers_mjx.runs.setup import Setup
from fingers_mjx.training.compile_cache import use_compile_cache
from fingers_mjx.training.errors import Diverged
from fingers_mjx.training.films import Films, check_drawable
from fingers_mjx.training.loop import Loop, LoopServices, StartPoint
from fingers_mjx.training.member import Place, about, read_end, shared_root
from fingers_mjx.training.population import Member, check_population
from fingers_mjx.training.progress import OnProgress, Ticker
from fingers_mjx.training.session import Session, bound, unset
from fingers_mjx.training.signals import StopSignals
from fingers_mjx.training.start import (
    FRESH,
    Brought,
    Start,
    brought,
    fresh,
    restored,
)
from fingers_mjx.training.watchdog import Watchdog

__all__ = ["FRESH", "Member", "Result", "Start", "train", "train_population"]

TICK_S = 1.0
"""Time between two reports of compilation."""


@dataclass(frozen=True)
class Result:
    """What a run gave.

    Attributes:
        run_dir: directory of the run.
        checkpoint: last checkpoint; None if it diverged before the first.
        iterations: done up to that checkpoint.
        metrics: last row of the learning curve; empty if there is none.
        diverged: why it stopped learning, None if it did not.
    """

    run_dir: Path
    checkpoint: Path | None
    iterations: int
    metrics: Mapping[str, Any]
    diverged: Diverged | None = None


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
    member = Member(setup, run_dir, start)
    [result] = train_population(
        env, [member], identity=identity, on_progress=on_progress
    )
    if result.diverged is not None:
        raise result.diverged
    return result


def train_population(
    env: VectorEnv,
    members: Sequence[Member],
    *,
    identity: Mapping[str, Any] | None = None,
    on_progress: OnProgress = lambda event: None,
) -> list[Result]:
    """Trains all members in one program; each leaves an ordinary run directory.

    A member that diverges is frozen, reported and left out of its files; the others go
    on. On the CPU each member is to the last bit what `train` alone would make of it.

    Args:
        env: worlds of all members, `num_envs` each, made from any of their setups.
        members: what each learns and where; see `check_population` for what they
            share. Those whose start resumes go on from the newest iteration that all
            of them have saved.
        identity: as in `train`.
        on_progress: as in `train`; with several members, events of one have its
            directory's name as "member".

    Raises:
        InputError, Interrupted, OutOfSpace: as in `train`.
    """
    check_population(members)
    for member in members:
        check_config(member.setup.train)
        check_installed(member.setup.train.loggers)
        check_drawable(member.setup.train)
    given = [brought(env, member.setup, member.start) for member in members]
    use_compile_cache()
    with ExitStack() as stack:
        paths = [
            stack.enter_context(open_run(m.run_dir, m.start.resume)) for m in members
        ]
        shared = [bound(env, m.setup, identity or {}) for m in members]
        ended = _ended(members, paths, shared)
        if not all(ended):
            files = list(zip(members, paths, shared, ended, strict=True))
            ended = _run(env, files, given, on_progress)
    return [_result(path, error) for path, error in zip(paths, ended, strict=True)]


Files = tuple[Member, Path, Mapping[str, Any], Diverged | None]
"""A member, its open directory, what a resumed run must share, and how it ended."""


def _run(
    env: VectorEnv,
    files: Sequence[Files],
    given: Sequence[Brought | None],
    on_progress: OnProgress,
) -> list[Diverged | None]:
    """Trains in open directories and returns who diverged."""

    def say(text: str) -> None:
        on_progress({"event": "note", "text": text})

    setups, paths = [f[0].setup for f in files], [f[1] for f in files]
    with ExitStack() as stack:
        stop = stack.enter_context(StopSignals(say))
        report, limit_s = paths[0] / "hang.txt", setups[0].train.hang_limit_s
        watchdog = stack.enter_context(Watchdog(report, limit_s))
        ticker = stack.enter_context(Ticker(on_progress, TICK_S))
        session = Session(env, setups)
        begin = _begin(session, files, given, say)
        places = _places(files)
        if any(given):
            begin = _saved(session, places, begin)
        for place in places:
            config = {"train": place.setup.train, "env": place.setup.env}
            record_run(place.path, config, place.bound, place.setup.hand)
        loggers = [chosen(setups[0].train.loggers, one) for one in about(places)]
        logs = [
            stack.enter_context(_curve(one, begin, own))
            for one, own in zip(files, loggers, strict=True)
        ]
        films = Films(setups[0].train, places, logs, say)
        stack.callback(films.stop)
        services = LoopServices(
            places, logs, on_progress, stop, films, watchdog, ticker
        )
        return Loop(session, services, begin).run()


def _ended(
    members: Sequence[Member], paths: Sequence[Path], shared: Sequence[Mapping]
) -> list[Diverged | None]:
    """Checks the runs to go on with and returns which members had diverged.

    A run of its own that diverged may be resumed: from its last checkpoint.
    """
    ended: list[Diverged | None] = []
    for member, path, facts in zip(members, paths, shared, strict=True):
        if member.start.resume:
            free = free_settings(member.setup)
            check_bound(path, facts, free, unset(member.setup))
        if len(members) == 1:
            (path / END_FILE).unlink(missing_ok=True)
        ended.append(read_end(path))
    return ended


def _begin(
    session: Session,
    files: Sequence[Files],
    given: Sequence[Brought | None],
    say: Callable[[str], None],
) -> StartPoint:
    """Returns the state that all members have saved, or that of a new population."""
    begin = None
    if all(member.start.resume for member, *_ in files):
        directories = [path / "checkpoints" for _, path, *_ in files]
        ended = [error for *_, error in files]
        begin = restored(session, directories, ended, say)
    return begin or fresh(session, given)


def _places(files: Sequence[Files]) -> list[Place]:
    """Returns where the files of members go; each is named by where it differs."""
    root = shared_root([path for _, path, _, _ in files])

    def name(path: Path) -> str:
        return path.relative_to(root).as_posix() if len(files) > 1 else ""

    return [
        Place(name(path), path, member.setup, facts) for member, path, facts, _ in files
    ]


def _saved(session: Session, places: Sequence[Place], begin: StartPoint) -> StartPoint:
    """Saves what a population begins with, lest an early kill loses it."""
    pairs = zip(places, session.split(begin.carry), strict=True)
    return replace(begin, saved=[place.save(own, 0, 0.0, 1) for place, own in pairs])


def _curve(files: Files, begin: StartPoint, loggers: Sequence[Open]) -> MetricsLog:
    """Opens the curve of a member; one that had diverged keeps all its rows."""
    member, path, _, error = files
    done = member.setup.train.iterations if error else begin.iteration
    return MetricsLog(path, done, loggers)


def _result(path: Path, error: Diverged | None) -> Result:
    """Returns what the run at `path` gave."""
    saved = checkpoint.checkpoints(path / "checkpoints")
    rows = read_metrics(path / "metrics.jsonl")
    done = int(saved[-1].name) if saved else 0
    last = saved[-1] if saved else None
    return Result(path, last, done, rows[-1] if rows else {}, error)
