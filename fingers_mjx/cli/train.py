"""`fingers train`: a new run, or one to go on with."""

import argparse
import dataclasses
import sys
import time
from pathlib import Path
from typing import Any

from envs.errors import InputError, one_of
from envs.physics import BACKENDS, default_backend
from envs.physics.quiet_mjx import WARP_INSTALLED
from envs.registry import get_task, task_names
from fingers_mjx.cli.paths import check_directory
from fingers_mjx.ppo.config import TrainConfig, preset
from fingers_mjx.ppo.state import train_template
from fingers_mjx.runs.setup import (
    Setup,
    identity,
    make_env,
    new_setup,
    overridden,
    run_setup,
)
from fingers_mjx.training.progress import reporter
from fingers_mjx.training.train import train
from fingers_mjx.training.warm_start import started_from

_FOR_NEW_RUNS = ("hand", "out", "warm_start")


def run(args: argparse.Namespace) -> int:
    """Trains, and reports on stdout."""
    _check_words(args.settings)
    check_directory("--out", args.out)
    resume = args.resume is not None
    setup = _resumed(args) if resume else _new(args)
    path = args.resume or args.out or _default_dir(setup.train)
    # Made here for its identity, and handed over: nothing is built twice.
    env = make_env(setup, setup.train.num_envs, setup.train.backend)
    if args.warm_start is not None:  # refused before anything is written
        started_from(train_template(env, setup.train.ppo), env, args.warm_start)
    with reporter(sys.stdout) as show:
        show({"event": "note", "text": _headline(setup, path)})
        result = train(
            lambda num_envs: env,
            setup.train,
            path,
            env_config=setup.env,
            hand=setup.hand,
            resume=resume,
            warm_start=args.warm_start,
            identity=identity(env),
            on_progress=show,
        )
        text = f"done after {result.iterations} iterations; next: fingers eval {path}"
        show({"event": "note", "text": text})
    return 0


def _new(args: argparse.Namespace) -> Setup:
    """Returns the settings of a new run."""
    if args.task is None:
        raise InputError("TASK", "", "", one_of(task_names()))
    get_task(args.task)
    backend = check_backend(args.backend or default_backend())
    name = args.preset or ("fast" if backend == "warp" else "cpu")
    chosen = preset(name, args.task)
    given: dict[str, Any] = {"backend": backend}
    if args.seed is not None:
        given["seed"] = args.seed
    train_config = dataclasses.replace(chosen, **given)
    return overridden(new_setup(train_config, args.hand), args.settings)


def _check_words(assignments: list[str]) -> None:
    """Refuses to set what the command line has words of its own for.

    Everything else follows from these two: the task's settings, the preset's values.
    """
    for text in assignments:
        name, _, value = text.partition("=")
        if name in ("task", "preset"):
            valid = f"{value} as {'TASK' if name == 'task' else '--preset'}"
            raise InputError("--set", name, value, f"without --set, {valid}")


def _resumed(args: argparse.Namespace) -> Setup:
    """Returns the saved settings; what may be changed in them, `--set` changes."""
    for name in _FOR_NEW_RUNS:
        if (found := getattr(args, name)) is not None:
            option = f"--{name.replace('_', '-')}"
            raise InputError(option, "", found, "only without --resume")
    saved = run_setup(args.resume)
    for name in ("task", "preset", "backend", "seed"):
        found, was = getattr(args, name), getattr(saved.train, name)
        if found not in (None, was):
            raise InputError(args.resume, name, found, f"{was}, as saved")
    return overridden(saved, args.settings)


def check_backend(name: str) -> str:
    """Returns `name`, the name of a physics backend.

    Raises:
        InputError: there is no such backend, or it is not installed.
    """
    if name not in BACKENDS:
        raise InputError("--backend", "", name, one_of(BACKENDS, name))
    if name == "warp" and not WARP_INSTALLED:
        valid = 'what is installed; pip install "fingers-mjx[warp]" for warp'
        raise InputError("--backend", "", name, valid)
    return name


def _default_dir(config: TrainConfig) -> Path:
    """Returns a directory of this second under `runs/`."""
    now = time.strftime("%Y%m%d-%H%M%S")
    return Path("runs") / f"{config.task}-{config.preset}-{config.seed}-{now}"


def _headline(setup: Setup, path: Path) -> str:
    train_config = setup.train
    steps: Any = train_config.iterations * train_config.steps_per_iteration
    return (
        f"training {train_config.task} (preset {train_config.preset}, backend "
        f"{train_config.backend}): {train_config.iterations} iterations, "
        f"{steps / 1e6:.4g} M control steps, into {path}"
    )
