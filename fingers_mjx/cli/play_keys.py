"""What `fingers play` presses on a keyboard: keys by name, or a level's solution."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from envs.errors import InputError, one_of
from fingers_mjx.play.sokoban import LEVELS, SOLUTIONS, Board, read_level

if TYPE_CHECKING:
    from envs.config.settings.keyboard import KeyboardConfig
    from fingers_deploy import Bundle
    from fingers_robot.behaviour.keyboard.keys import KeyTimes


def keys_asked(args: argparse.Namespace, bundle: Bundle) -> tuple[str, ...] | None:
    """Returns the keys that the options ask for; None if they ask for none.

    Raises:
        InputError: for a policy of another task, both options, or an unknown key.
    """
    if args.keys is None and args.level is None:
        return None
    option = "--keys" if args.level is None else "--level"
    if bundle.manifest.task != "keyboard":
        raise InputError(option, "", bundle.manifest.task, "a keyboard policy")
    if args.keys is not None and args.level is not None:
        raise InputError("--keys", "", args.keys, "either --keys or --level")
    return SOLUTIONS[LEVELS[args.level]] if args.level else keys_named(str(args.keys))


def keys_named(text: str) -> tuple[str, ...]:
    """Returns keys by their names.

    Args:
        text: that `--keys` gives, such as `up,left`.

    Raises:
        InputError: for an unknown key.
    """
    from fingers_robot.behaviour.keyboard.keys import ARROWS

    names = tuple(name.strip() for name in text.split(","))
    for name in names:
        if name not in ARROWS:
            raise InputError("--keys", "", name or "nothing", one_of(ARROWS, name))
    return names


def start_board(args: argparse.Namespace) -> Board | None:
    """Returns the board that the keys move, if a level is played."""
    return None if args.level is None else read_level(LEVELS[args.level])


def key_times(args: argparse.Namespace, config: KeyboardConfig) -> KeyTimes:
    """Returns gap and time-out: the mean gap and the time-out of training."""
    from fingers_robot.behaviour.keyboard.keys import KeyTimes

    requests = config.requests
    return KeyTimes(sum(requests.idle_s) / 2, requests.timeout_s, args.retries)
