"""`fingers play`: an exported policy in plain C MuJoCo, through the shim."""

import argparse
import dataclasses
import sys
from typing import Any

from envs.errors import InputError, one_of
from fingers_deploy import Bundle
from fingers_mjx.cli.output import counting
from fingers_mjx.cli.paths import check_file
from fingers_mjx.cli.play_keys import key_times, keys_asked, start_board
from fingers_mjx.cli.table import print_measures
from fingers_mjx.evaluation.files import write_summary
from fingers_mjx.evaluation.source import (
    document,
    nominal,
    with_command,
    without_practice,
)
from fingers_mjx.play.episodes import Session, play_episodes, schedule_of
from fingers_mjx.play.keyboard import TASK as KEYBOARD
from fingers_mjx.play.keyboard import KeyPlayer, keys_story
from fingers_mjx.play.keyboard_video import write_keyboard_video
from fingers_mjx.play.player import Player, Schedule
from fingers_mjx.play.recovery import (
    RecoveryPlayer,
    check_chain,
    is_recovery,
    story,
)
from fingers_mjx.play.video import VIDEO_SUFFIXES, write_video
from fingers_mjx.policy.source import PolicySource, load_bundle_setup
from fingers_mjx.runs.setup import Setup, make_env


def run(args: argparse.Namespace) -> int:
    """Plays; the table goes to stdout, progress to stderr."""
    if args.video and args.video.suffix not in VIDEO_SUFFIXES:
        valid = one_of(VIDEO_SUFFIXES)
        raise InputError("--video", "suffix", args.video.suffix, valid)
    check_file("--json", args.json)
    check_file("--video", args.video)
    bundle, trained = load_bundle_setup(args.bundle)
    setup = _setup(args, trained)
    player = _player(args, setup, bundle)
    steps = max(1, round(args.seconds / player.env.dt))
    schedule = _schedule(args, bundle, steps)
    with counting(sys.stderr, "playing", "episodes") as progress:
        played = play_episodes(
            player, args.episodes, steps, args.seed, schedule, progress
        )
    trained_steps = bundle.manifest.provenance.normalizer.steps
    source = PolicySource(args.bundle, setup, bundle.network, trained_steps)
    summary = document(source, played.table, args.seed, _conditions(args, played))
    if args.json:
        args.json.parent.mkdir(parents=True, exist_ok=True)
        write_summary(args.json, summary)
    if args.video:
        _film(args, bundle, player, played)
    print_measures(summary)
    if isinstance(player, RecoveryPlayer):
        print("first episode:", story(played.first, player.env.dt, _then_name(args)))
    if isinstance(player, KeyPlayer):
        print("keys:", keys_story(player.results, start_board(args)))
    return 0


def _player(args: argparse.Namespace, setup: Setup, bundle: Bundle) -> Player:
    """Returns what plays the bundle; recoveries end as the shim ends them."""
    keys = keys_asked(args, bundle)
    env = make_env(setup, 1, "cpu")
    if keys is not None:
        return KeyPlayer(env, bundle, keys, key_times(args, setup.env), args.runtime)
    if args.then is None and not is_recovery(bundle):
        return Player(env, bundle, args.runtime)
    commands = args.commands or []
    if args.then is None and commands:
        raise InputError("--command", "", commands[0], "--then: recovery has none")
    if len(commands) > 1:
        raise InputError("--command", "", f"{len(commands)} commands", "one")
    then = None if args.then is None else load_bundle_setup(args.then)[0]
    if then is not None:
        check_chain(bundle, then)
    command = tuple(commands[0]) if commands else None
    return RecoveryPlayer(env, bundle, then, command, args.runtime)


def _schedule(args: argparse.Namespace, bundle: Bundle, steps: int) -> Schedule | None:
    """Returns the command of each step; a recovery has none."""
    if not args.commands or is_recovery(bundle):
        return None
    return schedule_of(args.commands, steps)


def _then_name(args: argparse.Namespace) -> str | None:
    return None if args.then is None else args.then.absolute().name


def _setup(args: argparse.Namespace, trained: Setup) -> Setup:
    """Returns the worlds to play in."""
    setup = without_practice(trained if args.randomize else nominal(trained))
    if args.commands and len(args.commands) == 1 and args.then is None:
        setup = with_command(setup, args.commands[0])
    if args.friction is None:
        return setup
    both = (args.friction, args.friction)
    randomize = dataclasses.replace(setup.env.randomize, tip_friction=both)
    env = dataclasses.replace(setup.env, randomize=randomize)
    return dataclasses.replace(setup, env=env)


def _film(
    args: argparse.Namespace, bundle: Bundle, player: Player, played: Session
) -> None:
    """Draws the first episode."""
    args.video.parent.mkdir(parents=True, exist_ok=True)
    model, dt_s = player.env.mj_model, player.env.dt
    how = (args.video, model, played.first, dt_s, args.fps, args.width)
    with counting(sys.stderr, "drawing", "frames") as progress:
        if bundle.manifest.task == KEYBOARD:
            write_keyboard_video(*how, progress, start_board(args))
        else:
            write_video(*how, progress)


def _conditions(args: argparse.Namespace, played: Session) -> dict[str, Any]:
    """Returns what it takes to repeat it."""
    return {
        "loop": "C MuJoCo through fingers_deploy",
        "runtime": args.runtime,
        "then": _then_name(args),
        "seconds": args.seconds,
        "commands": args.commands,
        "keys": args.keys,
        "level": args.level,
        "retries": args.retries,
        "randomize": args.randomize,
        "friction": args.friction,
        "steps_held": played.held,
    }
