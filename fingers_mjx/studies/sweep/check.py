"""What is refused in a sweep before anything is trained."""

from collections.abc import Iterable
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

from envs.config.settings.backend import BACKENDS
from envs.errors import InputError, one_of
from envs.registry import get_task
from fingers_mjx.ppo.config import PRESETS
from fingers_mjx.studies.sweep.plan import (
    SETTINGS,
    Key,
    Training,
    overridden_at,
    trainings,
)
from fingers_mjx.studies.sweep.spec import Stage, Sweep, seed_list
from fingers_mjx.training.memory import check_memory

LAYERS = ("actor_layers", "critic_layers")
"""Shapes of the networks, which a stage takes over from the one before."""


def check_words(spec: Sweep, source: Path, backend: str) -> None:
    """Refuses a task, a preset or a backend that there is not, or that cannot run.

    Args:
        spec: as written or resolved.
        source: file of the specification, which errors name.
        backend: of the trainings.

    Raises:
        InputError: naming the field.
    """
    try:
        get_task(spec.task)
    except InputError as error:
        if error.source != "task":
            raise
        raise InputError(source, "task", error.found, error.valid) from error
    _check_one(source, "preset", spec.preset, PRESETS)
    backends = {"backend": backend, "evaluate.backend": spec.evaluate.backend}
    for field, name in backends.items():
        _check_one(source, field, name, BACKENDS)
        if name == "warp" and _trains_here(spec) and find_spec("warp") is None:
            valid = "what is installed: cpu or jax; warp needs the extra cuda12 or 13"
            raise InputError(source, field, name, valid)


def check_sweep(spec: Sweep, root: Path, source: Path) -> None:
    """Raises InputError at the first setting of any member that cannot work.

    Args:
        spec: resolved.
        root: directory of the sweep.
        source: file of the specification, which errors name.
    """
    seed = seed_list(spec.seeds)[0]
    try:
        for configuration in spec.configurations:
            stages = trainings(spec, root, Key(configuration, seed))
            _check_shapes(spec.stages, stages)
            if _trains_here(spec):
                for stage in stages:
                    check_memory(stage.setup.train, source=SETTINGS)
            overridden_at(stages[-1].setup, {"evaluate.set": spec.evaluate.set})
    except InputError as error:
        if error.source != SETTINGS:
            raise
        raise InputError(source, error.field, error.found, error.valid) from error


def _trains_here(spec: Sweep) -> bool:
    """Whether members are trained on this machine, and not on those of a cluster."""
    return not (spec.engine == "ray" and spec.address)


def _check_one(
    source: Path, field: str, name: str | None, known: Iterable[str]
) -> None:
    """Refuses a name, if one is given, that is not known."""
    if name is not None and name not in known:
        raise InputError(source, field, name, one_of(known, name))


def _check_shapes(stages: Iterable[Stage], made: Iterable[Training]) -> None:
    """Refuses a stage whose networks cannot be those of the stage before."""
    for (a, before), (b, after) in pairwise(zip(stages, made, strict=True)):
        for name in LAYERS:
            was = getattr(before.setup.train.ppo, name)
            now = getattr(after.setup.train.ppo, name)
            if now != was:
                field = f"stages.{b.name}.set.ppo.{name}"
                valid = f"{list(was)}, as stage {a.name}"
                raise InputError(SETTINGS, field, list(now), valid)
