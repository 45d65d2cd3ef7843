"""Trains and evaluates a member of a sweep, as far as that has not been done."""

import dataclasses
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from envs.errors import InputError
from fingers_mjx.evaluation import source as evaluating
from fingers_mjx.evaluation.evaluate import EpisodeTable
from fingers_mjx.evaluation.setups import as_deployed
from fingers_mjx.evaluation.together import evaluate_together
from fingers_mjx.policy.interface import identity
from fingers_mjx.policy.source import PolicySource, load_source
from fingers_mjx.ppo.config import free_fields
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.directory import CONFIG_FILE
from fingers_mjx.runs.setup import overridden, training_env
from fingers_mjx.studies.sweep.divergence import begins_again, set_aside
from fingers_mjx.studies.sweep.engines.population import most_worlds, shared
from fingers_mjx.studies.sweep.outcome import is_evaluated
from fingers_mjx.studies.sweep.plan import Key, Training, assignments, trainings
from fingers_mjx.studies.sweep.spec import Evaluation, Sweep
from fingers_mjx.training.population import Member
from fingers_mjx.training.progress import OnProgress
from fingers_mjx.training.start import Start
from fingers_mjx.training.train import train_population
from fingers_mjx.training.watchdog import Watchdog

HANG_FILE = "hang.txt"


def train_members(
    spec: Sweep, root: Path, keys: Sequence[Key], on_progress: OnProgress
) -> dict[Key, Exception]:
    """Trains what is missing of the stages of members.

    Args:
        spec: resolved.
        root: directory of the sweep.
        keys: the members.
        on_progress: called with the events of `fingers_mjx.training.progress`.

    Returns:
        Members that diverged, while the others went on.

    Raises:
        InputError, Interrupted, OutOfSpace: as `fingers_mjx.training.train`.
    """
    stages = {key: trainings(spec, root, key) for key in keys}
    begin = root / spec.warm_start if spec.warm_start else None
    lost: dict[Key, Exception] = {}
    for number in range(len(spec.stages)):
        fresh: dict[Key, Member] = {}
        resumed: dict[Key, Member] = {}
        for key in keys:
            before = stages[key][number - 1].path if number else begin
            one = stages[key][number]
            if begins_again(spec, one.path):
                set_aside(one.path)
            if key in lost or (start := start_of(one, before)) is None:
                continue
            group = resumed if start.resume else fresh
            group[key] = Member(one.setup, one.path, start)
        for group in (resumed, fresh):
            lost |= _train(group, on_progress)
    return lost


def _train(
    group: Mapping[Key, Member], on_progress: OnProgress
) -> dict[Key, Exception]:
    """Trains one stage of members as one program; returns those that diverged."""
    if not group:
        return {}
    setup = next(iter(group.values())).setup
    env = training_env(setup, len(group))
    results = train_population(
        env, list(group.values()), identity=identity(env), on_progress=on_progress
    )
    pairs = zip(group, results, strict=True)
    return {key: one.diverged for key, one in pairs if one.diverged is not None}


def start_of(training: Training, before: Path | None) -> Start | None:
    """Returns how a stage begins or goes on, None if it is finished.

    A run that was killed before its first checkpoint begins again, as does one that has
    what its warm start brought but not yet its settings, which are written after that.

    Args:
        training: the stage.
        before: run directory of the stage before, or the policy that the first starts
            from.
    """
    saved = checkpoint.checkpoints(training.path / "checkpoints")
    if not saved or not (training.path / CONFIG_FILE).exists():
        shutil.rmtree(training.path, ignore_errors=True)
        keep = training.keep_schedules
        return Start(warm_start=before, keep_schedules=keep)
    if int(saved[-1].name) >= training.setup.train.iterations:
        return None
    return Start(resume=True)


def evaluate_members(
    spec: Sweep, root: Path, keys: Sequence[Key]
) -> dict[Key, Exception]:
    """Evaluates the last stage of members as far as that has not been done.

    Members that share a program are evaluated in one, as many as a GPU has room for.

    Args:
        spec: resolved.
        root: directory of the sweep.
        keys: members that are trained.

    Returns:
        Members that could not be evaluated, while the others were.

    Raises:
        InputError: settings that do not fit.

    Source:
        Ours.
    """
    last = {key: trainings(spec, root, key)[-1] for key in keys}
    waiting = {k: v for k, v in last.items() if not is_evaluated(v.path)}
    most = max(1, most_worlds(spec) // spec.evaluate.episodes)
    groups: dict[str, list[Key]] = {}
    for key, one in waiting.items():
        groups.setdefault(shared([one]), []).append(key)
    lost: dict[Key, Exception] = {}
    for group in groups.values():
        for first in range(0, len(group), most):
            some = {key: waiting[key] for key in group[first : first + most]}
            lost |= _evaluate(some, spec.evaluate)
    return lost


def _evaluate(
    group: Mapping[Key, Training], wanted: Evaluation
) -> dict[Key, Exception]:
    """Evaluates trained runs into their directories, as `fingers eval` does."""
    settings = assignments(wanted.set)
    sources: dict[Key, PolicySource] = {}
    lost: dict[Key, Exception] = {}
    for key, one in group.items():
        try:
            sources[key] = _as_evaluated(one, settings)
        except InputError as error:
            lost[key] = error
    tables = _tables(list(sources.values()), next(iter(group.values())), wanted)
    for (key, source), table in zip(sources.items(), tables, strict=True):
        try:
            evaluating.check_room(table, source.setup.env)
        except InputError as error:
            lost[key] = error
            continue
        conditions = {
            "backend": wanted.backend or source.setup.train.backend,
            "steps": None,
            "command": None,
            "nominal": False,
            "settings": settings,
        }
        about = evaluating.document(source, table, wanted.seed, conditions)
        evaluating.write_evaluation(group[key].path / "eval", table, about)
    return lost


def _as_evaluated(one: Training, settings: Sequence[str]) -> PolicySource:
    """Returns the policy of a run with the settings of its evaluation.

    There is as much room for contacts as the sweep has now: the run may have had less.
    """
    loaded, env = load_source(one.path), one.setup.env
    room = {name: getattr(env, name) for name in free_fields(env)}
    trained = dataclasses.replace(loaded.setup.env, **room)
    setup = dataclasses.replace(loaded.setup, env=trained)
    setup = overridden(as_deployed(setup), settings)
    return dataclasses.replace(loaded, setup=setup)


def _tables(
    sources: Sequence[PolicySource], first: Training, wanted: Evaluation
) -> list[EpisodeTable]:
    """Runs the episodes of all policies; a process that hangs is ended."""
    backend = wanted.backend or first.setup.train.backend
    limit_s = first.setup.train.hang_limit_s
    with Watchdog(first.path / HANG_FILE, limit_s) as watchdog:

        def beat(done: int, total: int) -> None:
            watchdog.beat()

        if len(sources) > 1:
            return evaluate_together(
                sources, wanted.episodes, wanted.seed, backend, progress=beat
            )
        return [
            evaluating.evaluate_source(
                one, wanted.episodes, wanted.seed, backend, progress=beat
            )
            for one in sources
        ]
