"""Options that several commands share, and how their values are read and checked."""

from __future__ import annotations

import argparse
import dataclasses
import importlib.util
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from envs.config.settings.backend import BACKENDS
from envs.errors import InputError, one_of
from fingers_deploy.errors import shortened
from fingers_deploy.files import is_folder
from fingers_mjx.cli.machine.gpu import install_command, note_failed_cuda
from fingers_robot.cli.parser import plain_number, plain_whole

if TYPE_CHECKING:
    from envs.config.documented import Setting
    from fingers_mjx.cli.arguments.parser import CommandParser
    from fingers_mjx.ppo.config import TrainConfig

MAX_SEED = 2**32 - 1
MOST = 10**6
"""Beyond any number of episodes, steps or seconds that ends within days."""
POLICY_HELP = "run directory, exported bundle directory or its policy.onnx"
TASK_SETTING_HELP = (
    "a setting of the task such as env.episode_s=10; --help after POLICY lists all, "
    "each a flag too"
)


def command(
    commands,
    name: str,
    run: Callable,
    summary: str,
    details: str,
    computes: bool = True,
) -> CommandParser:
    """Adds a command and returns its parser; `run` is called with its arguments.

    JAX is prepared before `run`, unless the command sets `needs_jax` to False.

    Args:
        commands: of the parser above.
        name: as it is typed.
        run: takes the parsed arguments and returns the exit status.
        summary: for the list of commands.
        details: for its own help.
        computes: whether it would run on a GPU, which is then looked for.
    """
    parser = commands.add_parser(
        name, help=summary, description=details, allow_abbrev=False
    )
    parser.set_defaults(
        run=run,
        computes=computes,
        needs_jax=True,
        check=lambda args: None,
        dry_run=False,
        flags=(),
    )
    return parser


def offer_settings(
    parser: CommandParser,
    offered: Callable[[argparse.Namespace], Iterable[Setting]],
    preview: Callable[[argparse.Namespace], str],
) -> None:
    """Lets a command take settings as flags, and show what would be done with them.

    Args:
        parser: of the command, which has `--set` too.
        offered: returns, for the other arguments, the settings that may be given.
        preview: returns the resolved configuration as YAML.
    """
    parser.offered = offered
    parser.set_defaults(preview=preview)
    what = "print the resolved configuration as YAML and do nothing"
    parser.add_argument("--dry-run", action="store_true", help=what)


def whole(low: int, high: int = MOST) -> Callable[[str], int]:
    """Returns a converter to whole numbers from `low` to `high`."""

    def convert(text: str) -> int:
        value = plain_whole(text)
        if value is None or not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"found {shortened(text)}; valid: a whole number of at least {low} "
                f"and at most {high}"
            )
        return value

    return convert


def number(low: float = -MOST, high: float = MOST) -> Callable[[str], float]:
    """Returns a converter to numbers from `low` to `high`."""

    def convert(text: str) -> float:
        value = plain_number(text)
        if value is None or not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"found {shortened(text)}; valid: a finite number of at least "
                f"{low:.10g} and at most {high:.10g}"
            )
        return value

    return convert


def path(parser, *names: str, metavar: str = "FILE", **how) -> None:
    """Adds an option or an argument whose values are paths."""
    parser.add_argument(*names, type=_path, metavar=metavar, **how)


def _path(text: str) -> Path:
    """A path; an empty text would be the folder in which one stands."""
    if not text.strip():
        raise argparse.ArgumentTypeError("found an empty text; valid: a path")
    return Path(text)


def value(parser, name: str, kind: Callable, default: float, what: str) -> None:
    """Adds an option whose value is a number; its help ends with the default."""
    what = f"{what} (default {default:g})"
    parser.add_argument(name, type=kind, default=default, help=what)


def settings(parser, what: str) -> None:
    """Adds `--set`."""
    parser.add_argument(
        "--set",
        dest="settings",
        metavar="FIELD=VALUE",
        nargs="+",
        action="extend",
        default=[],
        help=what,
    )


def backend(parser) -> None:
    """Adds `--backend`."""
    parser.add_argument(
        "--backend",
        metavar="NAME",
        help="cpu, jax or warp; default: warp with an NVIDIA GPU, else cpu",
    )


def seed(parser, default: int | None = 0) -> None:
    """Adds `--seed`."""
    parser.add_argument(
        "--seed", type=whole(0, MAX_SEED), default=default, help="default 0"
    )


def episodes(parser, default: int) -> None:
    """Adds `--episodes`."""
    parser.add_argument(
        "--episodes", type=whole(1), default=default, help=f"default {default}"
    )


def policy_settings(args: argparse.Namespace) -> list[Setting]:
    """Returns the settings of the task of a policy, in `args.policy`."""
    from envs.config.documented import settings_of
    from fingers_mjx.policy.place import saved_settings
    from fingers_mjx.runs.settings import ENV_PREFIX

    if args.policy is None:
        return []
    return list(settings_of(saved_settings(args.policy).env, ENV_PREFIX))


def check_policy(args: argparse.Namespace) -> None:
    """Refuses what a policy cannot be measured with, before JAX loads.

    Raises:
        InputError: no policy, an unknown setting or backend.
    """
    from fingers_mjx.policy.place import check_policy

    check_backend(getattr(args, "backend", None))
    check_policy(args.policy, args.settings)


def fixed_command(parser, what: str) -> None:
    """Adds `--command`."""
    parser.add_argument(
        "--command",
        dest="commands",
        type=number(),
        nargs=3,
        action="append",
        metavar=("VX", "VY", "WZ"),
        help=f"{what}; default: drawn as in training",
    )


def check_file(option: str, path: Path | None) -> None:
    """Refuses a path to which no file can be written; nothing stays there.

    Args:
        option: that names the path, for the message.
        path: of the file; its directories may be missing. None is not looked at.

    Raises:
        InputError: naming what is in the way.
    """
    if path is None:
        return
    if is_folder(path):
        raise InputError(option, "", f"{path}, a directory", "a file to write")
    _check_place(option, path, path.absolute().parent)


def check_directory(option: str, path: Path | None) -> None:
    """As `check_file` for a directory to write into, which may exist.

    Raises:
        InputError: naming what is in the way.
    """
    if path is None:
        return
    is_folder(path)
    if path.absolute().resolve() == Path(path.absolute().anchor):
        raise InputError(option, "", path, "a folder other than that of everything")
    _check_place(option, path, path.absolute())


def _check_place(option: str, path: Path, directory: Path) -> None:
    """Tries the nearest directory that exists, with a file without a name."""
    while not directory.exists() and directory != directory.parent:
        directory = directory.parent
    try:
        with tempfile.TemporaryFile(dir=directory):
            return
    except OSError as error:
        found = f"{path} ({error.strerror}: {directory})"
        raise InputError(option, "", found, "a place to write to") from error


def check_backend(name: str | None) -> None:
    """Refuses a physics backend without importing one.

    Args:
        name: that `--backend` gives, if any.

    Raises:
        InputError: there is no such backend, or it is not installed.
    """
    if name is None:
        return
    if name not in BACKENDS:
        raise InputError("--backend", "", name, one_of(BACKENDS, name))
    if name == "warp" and not has_warp():
        valid = f"what is installed; for warp: {install_command()}"
        raise InputError("--backend", "", name, valid)


def has_warp() -> bool:
    """Whether Warp is installed; without it, no device need be asked for."""
    return importlib.util.find_spec("warp") is not None


def backend_of(args: argparse.Namespace) -> str:
    """Returns the physics backend that `--backend` names, or the machine's.

    Raises:
        InputError: there is no such backend, or it is not installed.
    """
    check_backend(args.backend)
    if args.backend or not has_warp():
        return args.backend or "cpu"
    from envs.physics.backends import default_backend

    return default_backend(note_failed_cuda)


def train_config(
    args: argparse.Namespace, backend: str, seed: int | None
) -> TrainConfig:
    """Returns the preset that `--preset` names, or the one for a backend."""
    from fingers_mjx.ppo.config import preset

    name = args.preset or ("fast" if backend == "warp" else "cpu")
    given: dict[str, Any] = {"backend": backend}
    if seed is not None:
        given["seed"] = seed
    return dataclasses.replace(preset(name, args.task), **given)
