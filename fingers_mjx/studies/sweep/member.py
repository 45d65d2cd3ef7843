"""Trains and evaluates a member of a sweep, as far as that has not been done."""

import dataclasses
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from fingers_mjx.evaluation import source as evaluating
from fingers_mjx.policy.interface import identity
from fingers_mjx.policy.source import load_source
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.directory import CONFIG_FILE
from fingers_mjx.runs.setup import make_env, overridden
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
    env = make_env(setup, len(group) * setup.train.num_envs, setup.train.backend)
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


def evaluate_member(spec: Sweep, root: Path, key: Key) -> None:
    """Evaluates the last stage of a member, unless that has been done.

    Raises:
        InputError: as `evaluate_run`.
    """
    last = trainings(spec, root, key)[-1]
    if not is_evaluated(last.path):
        evaluate_run(last.path, spec.evaluate, last.setup.train.hang_limit_s)


def evaluate_run(run: Path, wanted: Evaluation, hang_limit_s: float) -> None:
    """Evaluates a trained run into its directory, as `fingers eval` does.

    Args:
        run: run directory.
        wanted: episodes, seed, backend and settings.
        hang_limit_s: as in training; a process that hangs is ended.

    Raises:
        InputError: settings that do not fit, or no space for the contacts.
    """
    loaded = load_source(run)
    settings = assignments(wanted.set)
    setup = overridden(evaluating.as_deployed(loaded.setup), settings)
    source = dataclasses.replace(loaded, setup=setup)
    backend = wanted.backend or setup.train.backend
    with Watchdog(run / HANG_FILE, hang_limit_s) as watchdog:
        table = evaluating.evaluate_source(
            source,
            wanted.episodes,
            wanted.seed,
            backend,
            progress=lambda done, total: watchdog.beat(),
        )
    conditions = {
        "backend": backend,
        "steps": None,
        "command": None,
        "nominal": False,
        "settings": settings,
    }
    about = evaluating.document(source, table, wanted.seed, conditions)
    evaluating.write_evaluation(run / "eval", table, about)
