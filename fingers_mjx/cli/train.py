"""`fingers train`: a new run, or one to go on with."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from envs.errors import InputError, one_of
from fingers_mjx.cli import options

if TYPE_CHECKING:
    from fingers_mjx.ppo.config import TrainConfig
    from fingers_mjx.runs.setup import Setup

_FOR_NEW_RUNS = ("hand", "out", "warm_start", "schedules")


def add(commands) -> None:
    """Adds the command and its arguments."""
    parser = options.command(
        commands,
        "train",
        run,
        "train a policy",
        "Train a policy. Shows progress live on a terminal, as JSON lines otherwise. "
        "SIGINT saves and stops; --resume goes on.",
    )
    parser.add_argument("task", metavar="TASK", nargs="?", help="such as crawl")
    parser.add_argument(
        "--preset",
        metavar="NAME",
        help="paper (its settings), adapt (its second stage, with --warm-start), fast "
        "(one GPU) or cpu (small); default: by machine",
    )
    what = "a setting such as ppo.entropy_cost=0.001 or env.action_clip=0.8"
    options.settings(parser, what)
    options.backend(parser)
    options.seed(parser, None)
    options.path(parser, "--hand", help="hand.yaml; default: the paper's hand")
    options.path(
        parser, "--out", metavar="RUN", help="new directory; default: under runs/"
    )
    options.path(parser, "--resume", metavar="RUN", help="go on with this run")
    options.path(
        parser,
        "--warm-start",
        metavar="RUN|BUNDLE",
        help="start from the networks of this run or checkpoint, or from the policy of "
        "a bundle, which may be of another task",
    )
    parser.add_argument(
        "--schedules",
        choices=("keep", "restart"),
        help="after --warm-start, whether reward schedules go on from the steps that "
        "the run has done; default restart",
    )


def run(args: argparse.Namespace) -> int:
    """Trains, and reports on stdout."""
    from fingers_mjx.policy.interface import identity
    from fingers_mjx.runs.setup import make_env
    from fingers_mjx.training.progress import reporter
    from fingers_mjx.training.train import Start, train

    _check_words(args.settings)
    options.check_directory("--out", args.out)
    resume = args.resume is not None
    setup = _resumed(args) if resume else _new(args)
    path = args.resume or args.out or _default_dir(setup.train)
    env = make_env(setup, setup.train.num_envs, setup.train.backend)
    with reporter(sys.stdout) as show:
        show({"event": "note", "text": _headline(setup.train, path)})
        result = train(
            env,
            setup,
            path,
            start=Start(resume, args.warm_start, args.schedules == "keep"),
            identity=identity(env),
            on_progress=show,
        )
        text = f"done after {result.iterations} iterations; next: fingers eval {path}"
        show({"event": "note", "text": text})
    return 0


def _new(args: argparse.Namespace) -> Setup:
    """Returns the settings of a new run."""
    from envs.registry import get_task, task_names
    from fingers_mjx.runs.setup import new_setup, overridden

    if args.task is None:
        raise InputError("TASK", "", "", one_of(task_names()))
    get_task(args.task)
    if args.preset == "adapt" and args.warm_start is None:
        valid = "with --warm-start RUN, a first stage"
        raise InputError("--preset", "", args.preset, valid)
    setup = new_setup(options.train_config(args, args.seed), args.hand)
    return overridden(setup, args.settings)


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
    from fingers_mjx.runs.setup import overridden, run_setup

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


def _default_dir(config: TrainConfig) -> Path:
    """Returns a directory of this second under `runs/`."""
    now = time.strftime("%Y%m%d-%H%M%S")
    return Path("runs") / f"{config.task}-{config.preset}-{config.seed}-{now}"


def _headline(config: TrainConfig, path: Path) -> str:
    steps: Any = config.iterations * config.steps_per_iteration
    return (
        f"training {config.task} (preset {config.preset}, backend {config.backend}): "
        f"{config.iterations} iterations, {steps / 1e6:.4g} M control steps, into "
        f"{path}"
    )
