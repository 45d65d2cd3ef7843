"""`fingers play --keys` and `--level`: what is to be pressed."""

import argparse

from envs.errors import InputError, one_of
from envs.tasks.keyboard.task import KeyboardConfig
from fingers_deploy import Bundle
from fingers_mjx.play.keyboard import TASK
from fingers_mjx.play.sokoban import ONE_BOX, SOLUTIONS, TWO_BOXES, Board, read_level
from fingers_robot.behaviour.keys import ARROWS, KeyTimes

LEVELS = {"one-box": ONE_BOX, "two-boxes": TWO_BOXES}


def keys_asked(args: argparse.Namespace, bundle: Bundle) -> tuple[str, ...] | None:
    """Returns the keys that the options ask for; None if they ask for none.

    Raises:
        InputError: for a policy of another task, both options, or an unknown key.
    """
    if args.keys is None and args.level is None:
        return None
    option = "--keys" if args.level is None else "--level"
    if bundle.manifest.task != TASK:
        raise InputError(option, "", bundle.manifest.task, "a keyboard policy")
    if args.keys is not None and args.level is not None:
        raise InputError("--keys", "", args.keys, "either --keys or --level")
    return SOLUTIONS[LEVELS[args.level]] if args.level else _listed(str(args.keys))


def start_board(args: argparse.Namespace) -> Board | None:
    """Returns the board that the keys move, if a level is played."""
    return None if args.level is None else read_level(LEVELS[args.level])


def key_times(args: argparse.Namespace, config: KeyboardConfig) -> KeyTimes:
    """Returns gap and time-out: the mean gap and the time-out of training."""
    requests = config.requests
    return KeyTimes(sum(requests.idle_s) / 2, requests.timeout_s, args.retries)


def _listed(text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(","))
    for name in names:
        if name not in ARROWS:
            raise InputError("--keys", "", name or "nothing", one_of(ARROWS, name))
    return names
