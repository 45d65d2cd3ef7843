"""`fingers train`: a new run, or one to go on with."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from envs.errors import InputError, one_of
from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.arguments.inputs import check_hand, check_start
from fingers_mjx.cli.machine.jax_ready import prepare_jax
from fingers_mjx.runs.members import MEMBERS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from envs.config.documented import Setting
    from fingers_mjx.ppo.config import TrainConfig
    from fingers_mjx.runs.settings import Settings
    from fingers_mjx.training.population import Member
    from fingers_mjx.training.train import Result

_FOR_NEW_RUNS = ("hand", "out", "warm_start", "schedules", "seeds")

_WORDS = ("task", "preset", "seed", "backend")
"""Settings for which the command line has words of its own."""

MOST_SEEDS = 100


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
    parser.set_defaults(check=check)
    options.offer_settings(parser, _offered, _preview)
    what = "such as crawl; --help after it lists all settings, each a flag too"
    parser.add_argument("task", metavar="TASK", nargs="?", help=what)
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
    parser.add_argument(
        "--seeds",
        metavar="N",
        type=options.whole(1, MOST_SEEDS),
        help="train N learners in one program, of --seed and the seeds after it, each "
        f"into a run directory {MEMBERS}/NN of its own",
    )
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


def check(args: argparse.Namespace) -> None:
    """Refuses what no run can be made of, before JAX loads.

    Raises:
        InputError: an unknown name or a value out of range; sizes that no machine or
            not this one has room for; a start that is neither a folder nor a regular
            file; or what is no hand file.
        ModuleNotFoundError: a logger that is not installed.
    """
    from fingers_mjx.training.memory import check_memory

    _check_words(args.settings)
    options.check_backend(args.backend)
    check_start(args.warm_start)
    options.check_directory("--out", args.out)
    if args.resume is not None:
        for path in _resumed_paths(args):
            _check_loggers(_resumed(args, path))
        return
    settings = _new(args, args.backend or "cpu")
    check_hand(args.hand)
    _check_loggers(settings)
    if args.preset != "adapt":  # sizes that have been trained with
        check_memory(settings.train, args.seeds or 1)


def _check_loggers(settings: Settings) -> None:
    """Refuses loggers that are not installed."""
    if settings.train.loggers:
        from fingers_mjx.runs.loggers.choice import check_installed

        check_installed(settings.train.loggers)


def _offered(args: argparse.Namespace) -> list[Setting]:
    """Returns the settings of a run: of its learner alone while there is no task."""
    from envs.config.documented import settings_of
    from fingers_mjx.ppo.config import preset
    from fingers_mjx.runs.settings import ENV_PREFIX, run_settings

    if args.task is None and args.resume is None:
        train, env = preset(args.preset or "cpu"), None
    else:
        settings = (
            run_settings(_resumed_paths(args)[0])
            if args.resume is not None
            else _new(args, args.backend or "cpu")
        )
        train, env = settings.train, settings.env
    learner = [s for s in settings_of(train) if s.name not in _WORDS]
    return learner if env is None else [*learner, *settings_of(env, ENV_PREFIX)]


def _preview(args: argparse.Namespace) -> str:
    """Returns the `config.yaml` of the run; of several, that of the first."""
    from fingers_mjx.runs.settings import settings_yaml

    if args.resume is not None:
        return settings_yaml(_resumed(args, _resumed_paths(args)[0]))
    if args.backend is None and options.has_warp():
        prepare_jax()
    return settings_yaml(_new(args, options.backend_of(args)))


def run(args: argparse.Namespace) -> int:
    """Trains, and reports on stdout."""
    from fingers_mjx.policy.interface import identity
    from fingers_mjx.runs.setup import training_env
    from fingers_mjx.training.progress import reporter
    from fingers_mjx.training.train import train_population

    path, members = _members(args)
    setup = members[0].setup
    env = training_env(setup, len(members))
    with reporter(sys.stdout) as show:
        show({"event": "note", "text": _headline(setup.train, path, len(members))})
        results = train_population(
            env, members, identity=identity(env), on_progress=show
        )
        lost = [result.diverged for result in results if result.diverged]
        if lost and len(members) == 1:
            raise lost[0]
        text = _done(results, members)
        show({"event": "note", "text": text})
    return lost[0].exit_code if lost else 0


def _members(args: argparse.Namespace) -> tuple[Path, list[Member]]:
    """Returns the directory of what is trained, and the learners: one, or several."""
    from envs.hand.hand_file import DEFAULT_HAND_FILE, load_hand_file
    from fingers_mjx.runs.directory import HAND_FILE
    from fingers_mjx.runs.setup import with_hand, with_seed
    from fingers_mjx.training.population import Member
    from fingers_mjx.training.start import Start

    if args.resume is not None:
        start = Start(resume=True)
        found = [(_resumed(args, p), p) for p in _resumed_paths(args)]
        return args.resume, [
            Member(with_hand(s, load_hand_file(p / HAND_FILE)), p, start)
            for s, p in found
        ]
    settings = _new(args, options.backend_of(args))
    setup = with_hand(settings, load_hand_file(args.hand or DEFAULT_HAND_FILE))
    path = args.out or _default_dir(setup.train)
    start = Start(False, args.warm_start, args.schedules == "keep")
    if args.seeds is None:
        return path, [Member(setup, path, start)]
    return path, [
        Member(
            with_seed(setup, setup.train.seed + index),
            path / MEMBERS / f"{index:02d}",
            start,
        )
        for index in range(args.seeds)
    ]


def _done(results: Sequence[Result], members: Sequence[Member]) -> str:
    """Returns the last sentence."""
    most = max(result.iterations for result in results)
    lost = [m.run_dir.name for m, r in zip(members, results, strict=True) if r.diverged]
    left = f"; diverged: {', '.join(lost)}" if lost else ""
    place = members[0].run_dir
    return f"done after {most} iterations{left}; next: fingers eval {place}"


def _new(args: argparse.Namespace, backend: str) -> Settings:
    """Returns the settings of a new run."""
    from envs.registry import get_task, task_names
    from fingers_mjx.runs.settings import new_settings, overridden

    if args.task is None:
        raise InputError("TASK", "", "", one_of(task_names()))
    get_task(args.task)
    if args.preset == "adapt" and args.warm_start is None:
        valid = "with --warm-start RUN, a first stage"
        raise InputError("--preset", "", args.preset, valid)
    train = options.train_config(args, backend, args.seed)
    return overridden(new_settings(train), args.settings)


def _check_words(assignments: list[str]) -> None:
    """Refuses to set what the command line has words of its own for.

    Everything else follows from these two: the task's settings, the preset's values.
    """
    for text in assignments:
        name, _, value = text.partition("=")
        if name in ("task", "preset"):
            valid = f"{value} as {'TASK' if name == 'task' else '--preset'}"
            raise InputError("--set", name, value, f"without --set, {valid}")


def _resumed_paths(args: argparse.Namespace) -> list[Path]:
    """Returns the runs to go on with: the members of a population, or one run.

    Raises:
        InputError: an option that a run to go on with has decided already.
    """
    for name in _FOR_NEW_RUNS:
        if (found := getattr(args, name)) is not None:
            option = f"--{name.replace('_', '-')}"
            raise InputError(option, "", found, "only without --resume")
    inside = sorted((args.resume / MEMBERS).glob("*"))
    if inside and args.seed is not None:
        valid = f"nothing: {len(inside)} members have seeds of their own"
        raise InputError("--seed", "", args.seed, valid)
    return inside or [args.resume]


def _resumed(args: argparse.Namespace, path: Path) -> Settings:
    """Returns the saved settings; what may be changed in them, `--set` changes."""
    from fingers_mjx.runs.settings import overridden, run_settings

    saved = run_settings(path)
    for name in ("task", "preset", "backend", "seed"):
        found, was = getattr(args, name), getattr(saved.train, name)
        if found not in (None, was):
            raise InputError(path, name, found, f"{was}, as saved")
    return overridden(saved, args.settings)


def _default_dir(config: TrainConfig) -> Path:
    """Returns a directory of this second under `runs/`."""
    now = time.strftime("%Y%m%d-%H%M%S")
    return Path("runs") / f"{config.task}-{config.preset}-{config.seed}-{now}"


def _headline(config: TrainConfig, path: Path, members: int) -> str:
    steps: Any = config.iterations * config.steps_per_iteration * members
    many = f"{members} learners, " if members > 1 else ""
    return (
        f"training {config.task} (preset {config.preset}, backend {config.backend}): "
        f"{many}{config.iterations} iterations, {steps / 1e6:.4g} M control steps, "
        f"into {path}"
    )
