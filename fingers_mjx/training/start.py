"""How training begins: afresh, with what was learned elsewhere, or where it stopped."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import jax.numpy as jnp

from envs.base import VectorEnv
from envs.errors import InputError
from fingers_mjx.ppo.state import Carry, TrainState, strong, train_template
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.setup import Setup
from fingers_mjx.training.errors import Diverged
from fingers_mjx.training.loop import StartPoint
from fingers_mjx.training.schedules import steps_done, with_steps
from fingers_mjx.training.session import Session
from fingers_mjx.training.warm_start import completed, started_from

Say = Callable[[str], None]


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


@dataclass(frozen=True)
class Brought:
    """What a warm start brings.

    Attributes:
        train: networks and normalizer.
        steps: control steps that the schedules of each world have come to.
    """

    train: TrainState
    steps: int


def brought(env: VectorEnv, setup: Setup, start: Start) -> Brought | None:
    """Reads what a warm start brings; None if the run starts without.

    Raises:
        InputError: networks of other sizes, or schedules that cannot go on.
    """
    if start.warm_start is None:
        return None
    steps = steps_done(start.warm_start) if start.keep_schedules else 0
    template = train_template(env, setup.train.ppo)
    return Brought(started_from(template, env, start.warm_start), steps)


def fresh(session: Session, given: Sequence[Brought | None]) -> StartPoint:
    """Returns the state of an untrained population.

    Args:
        session: the population.
        given: what each member has from elsewhere, None for nothing.
    """
    carry, nobody = session.start(), [None] * session.members
    if any(given):
        pairs = zip(session.split(carry), given, strict=True)
        carry = strong(session.join([_with(own, more) for own, more in pairs]))
    return StartPoint(carry, 0, 0.0, nobody, nobody)


def restored(
    session: Session,
    directories: Sequence[Path],
    ended: Sequence[Diverged | None],
    say: Say,
) -> StartPoint | None:
    """Returns the newest state that all members have saved; None if none was.

    A member that had diverged is as it was saved last, and stays so.

    Args:
        session: the population.
        directories: of the members' checkpoints.
        ended: why a member no longer learns, None where it does.
        say: called with one sentence for each checkpoint that is passed over.

    Raises:
        InputError: damaged checkpoints, or none that all members have.
    """
    for directory in directories:
        checkpoint.clean(directory)
    live = [d for d, error in zip(directories, ended, strict=True) if error is None]
    newest = _common(live, say)
    if newest is None:
        return None
    for directory in live:
        checkpoint.set_aside(directory, int(newest.name))
    say(f"going on from {newest}")
    saved = [directory / newest.name for directory in directories]
    loaded = [
        None if error else checkpoint.load(at)
        for error, at in zip(ended, saved, strict=True)
    ]
    carries = [
        _frozen(session, directory, say) if one is None else one.into(session.template)
        for directory, one in zip(directories, loaded, strict=True)
    ]
    meta = next(one.meta for one in loaded if one is not None)
    carry = strong(session.join(carries))
    return StartPoint(carry, meta["iteration"], meta["trained_s"], saved, ended)


def _common(directories: Sequence[Path], say: Say) -> Path | None:
    """Returns the newest checkpoint that all members have, in the first's directory."""
    at_most = None
    while True:
        found = [checkpoint.newest(d, say, at_most) for d in directories]
        saved = [path for path in found if path is not None]
        if len(saved) < len(found) and at_most is None:
            return None
        if len(saved) < len(found):
            valid = "a checkpoint of the same iteration in every member"
            raise InputError(directories[0].parent, "checkpoints", "none", valid)
        steps = {int(path.name) for path in saved}
        if len(steps) == 1:
            return saved[0]
        at_most = min(steps)


def _frozen(session: Session, directory: Path, say: Say) -> Carry:
    """Returns the last state of a member that had diverged, which it will keep."""
    newest = checkpoint.newest(directory, say)
    if newest is None:
        carry = session.split(session.start())[0]
    else:
        carry = checkpoint.load(newest).into(session.template)
    limit = jnp.full((), session.learner.config.max_bad_updates, jnp.int32)
    health = replace(carry.train.health, worst_streak=limit)
    return replace(carry, train=replace(carry.train, health=health))


def _with(carry: Carry, given: Brought | None) -> Carry:
    """Returns a fresh state with what was learned and counted elsewhere."""
    if given is None:
        return carry
    train = completed(given.train, carry.train)
    worlds = with_steps(carry.worlds, given.steps) if given.steps else carry.worlds
    return replace(carry, train=train, worlds=worlds)
