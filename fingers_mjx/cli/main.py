"""The command `fingers`: train, evaluate, export, play, show the hand, demonstrate.

Exit status: 0 done; 2 bad input; 3 learning diverged; 4 no room on the disk; 5 a sweep
that is over and lacks members; 6 an installation that cannot work; 75 stopped by a
signal after a checkpoint, go on with --resume; 130 stopped by the keyboard; 141 nobody
reads what it prints, as after `| head`.
"""

import argparse
import importlib
import os
import select
import sys
from collections.abc import Sequence

from fingers_deploy.errors import InputError, shortened
from fingers_mjx.cli import doctor
from fingers_mjx.cli.arguments.parser import CommandParser, as_typed
from fingers_mjx.cli.machine.gpu import idle_gpu, install_command, quiet_jax
from fingers_mjx.cli.machine.installation import (
    DISTRIBUTION,
    UnsupportedInstallation,
    check_installation,
    check_places,
    version,
)
from fingers_mjx.cli.machine.jax_ready import prepare_jax
from fingers_robot.cli.parser import UsageError, refuse_empty

COMMANDS = (
    "train",
    "evaluate",
    "steer",
    "sweep",
    "compare",
    "export",
    "play",
    "hand",
    "log",
    "tasks",
    "doctor",
)
SYSID = ("info", "describe", "excite", "calibrate", "diagnose", "transfer")
"""Modules of the commands, and of the actions of `fingers sysid`."""

BAD_INPUT, KEYBOARD, NO_READER = 2, 130, 141
"""Here, since `envs` may be a foreign package until `check_places` has looked."""
_EXTRAS = {
    module: extra
    for extra, modules in reversed(doctor.EXTRAS.items())
    for module in modules
}
"""The extra that brings a module; of several, the first that `doctor` lists."""


class _Version(argparse.Action):
    """Prints our version, which is looked up only when it is asked for."""

    def __call__(self, parser, namespace, values, option_string=None):
        print(f"{DISTRIBUTION} {version()}")
        parser.exit()


def make_parser() -> argparse.ArgumentParser:
    """Returns the parser of all commands; each names its function in `args.run`."""
    parser = CommandParser(
        prog="fingers",
        description="Teach an anthropomorphic hand to walk on its fingertips.",
        epilog="`fingers tasks` lists the tasks, `fingers train TASK --help` the "
        "settings of one. Exit status: 0 done, 2 bad input, 3 diverged, 4 disk full, "
        "5 members of a sweep missing, 6 an installation that cannot work, 75 stopped "
        "by a signal after saving (go on with --resume).",
    )
    what = "show the version and exit"
    parser.add_argument("--version", action=_Version, nargs=0, help=what)
    _add(parser, "arguments.completion")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name in COMMANDS:
        _add(commands, name)
    summary = "look at measured logs"
    sysid = commands.add_parser("sysid", help=summary, description=f"L{summary[1:]}.")
    actions = sysid.add_subparsers(metavar="ACTION", required=True)
    for name in SYSID:
        _add(actions, f"sysid.{name}")
    _add(commands, "demo")
    return parser


def _add(place, name: str) -> None:
    """Imports a command, which imports what is heavy when it runs, and adds it."""
    importlib.import_module(f"fingers_mjx.cli.{name}").add(place)


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status; errors are one sentence on stderr.

    Args:
        argv: arguments after the program's name; those of the process if not given.
    """
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    words = sys.argv[1:] if argv is None else list(argv)
    args = argparse.Namespace(flags=())
    try:
        if words == ["doctor"]:  # it says what is wrong where nothing else can run
            return _printed(doctor.run())
        check_places()
        args = make_parser().parse_args(words)
        refuse_empty(args)
        check_installation()
        args.check(args)
        _note_idle_gpu(args)
        return _printed(_run(args))
    except SystemExit:  # after --help or --version
        _unread()
        raise
    except KeyboardInterrupt:
        return _say("stopped", KEYBOARD)
    except Exception as error:
        if isinstance(error, BrokenPipeError) and _unread():
            return NO_READER
        status = _status(error)
        if status is None:
            raise
        if isinstance(error, InputError):
            error = as_typed(error, args.flags)
        return _say(_sentence(error), status)


def _run(args: argparse.Namespace) -> int:
    """Runs a command that has been checked, or shows what it would do."""
    if args.dry_run:
        print(args.preview(args), end="")
        return 0
    if args.needs_jax:
        prepare_jax()
    return args.run(args)


def _printed(status: int) -> int:
    """Returns an exit status when all that was printed has been taken."""
    sys.stdout.flush()
    return status


def _unread() -> bool:
    """Whether nobody reads stdout any more; what it still holds is then dropped."""
    try:
        place = sys.stdout.fileno()
    except OSError:  # in a test, or a notebook, which has no pipe
        return False
    ends = select.poll()
    ends.register(place, 0)
    if not any(event & (select.POLLERR | select.POLLHUP) for _, event in ends.poll(0)):
        return False
    os.dup2(os.open(os.devnull, os.O_WRONLY), place)
    return True


def _note_idle_gpu(args: argparse.Namespace) -> None:
    """Says once that a command leaves a GPU idle that nobody declined."""
    backend = getattr(args, "backend", None)
    if args.computes and (sentence := idle_gpu(backend)):
        print(f"fingers: {sentence}", file=sys.stderr)
        quiet_jax()


def _status(error: Exception) -> int | None:
    """Returns the exit status of an error that a user can meet, None for a fault."""
    if isinstance(error, UsageError):
        return BAD_INPUT
    if isinstance(error, ModuleNotFoundError):
        return BAD_INPUT if error.name in _EXTRAS else None
    if isinstance(error, UnsupportedInstallation):  # ours cannot even be imported
        return error.exit_code
    from fingers_mjx.training.errors import exit_status

    return exit_status(error)


def _sentence(error: Exception) -> str:
    """Returns what went wrong on one line."""
    if isinstance(error, ModuleNotFoundError):
        extra = _EXTRAS[str(error.name)]
        return f"{error.name} is not installed; {install_command(extra)}"
    if isinstance(error, OSError) and error.filename:
        valid = "a path that can be read and written"
        return f"{shortened(error.filename)}: found {error.strerror}; valid: {valid}"
    return " ".join(str(error).split())


def _say(sentence: str, status: int) -> int:
    print(f"fingers: {sentence}", file=sys.stderr)
    return status


if __name__ == "__main__":
    sys.exit(main())
