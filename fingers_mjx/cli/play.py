"""`fingers play`: an exported policy in plain C MuJoCo, through the shim."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from envs.errors import InputError, one_of
from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.play_keys import key_times, keys_asked, keys_named, start_board
from fingers_mjx.play.sokoban import LEVELS

if TYPE_CHECKING:
    from fingers_deploy import Bundle
    from fingers_mjx.play.episodes import Session
    from fingers_mjx.play.player import Player
    from fingers_mjx.runs.setup import Setup


CRAWL_POLICY = Path(__file__).parents[1] / "policies" / "crawl"
"""The committed policy that crawls."""
VIDEO_SUFFIXES = (".mp4", ".webp", ".gif")


def add(commands) -> None:
    """Adds the command and its arguments."""
    parser = options.command(
        commands,
        "play",
        run,
        "close the loop in plain C MuJoCo through the deployment shim",
        "Close the loop in plain C MuJoCo through the deployment shim. Physics at 200 "
        "Hz, the exported policy at 50 Hz through fingers_deploy; the training "
        "environment takes no part.",
        computes=False,
    )
    parser.set_defaults(check=_check)
    options.offer_settings(parser, options.policy_settings, _preview)
    what = f"{options.POLICY_HELP}; --viewer takes the committed crawl policy"
    options.path(parser, "policy", metavar="POLICY", nargs="?", help=what)
    options.settings(parser, options.TASK_SETTING_HELP)
    _add_viewer(parser)
    options.path(
        parser,
        "--then",
        metavar="BUNDLE",
        help="after a recovery: policy that takes over once the hand stands, under "
        "--command (default: its fastest forward)",
    )
    _add_keys(parser)
    options.path(parser, "--video", help=".mp4, .webp or .gif to write")
    options.value(parser, "--seconds", options.number(0.1), 20.0, "length")
    options.episodes(parser, 1)
    options.seed(parser)
    what = "m/s, m/s, rad/s in V; given several times, they share the time equally"
    options.fixed_command(parser, what)
    parser.add_argument(
        "--randomize",
        action="store_true",
        help="worlds, sensor noise and starts as drawn in training; else the nominal "
        "hand",
    )
    parser.add_argument(
        "--friction",
        type=options.number(0.0),
        metavar="MU",
        help="friction of the fingertips",
    )
    parser.add_argument(
        "--runtime",
        choices=("auto", "onnxruntime", "numpy"),
        default="auto",
        help="what runs the policy",
    )
    options.value(parser, "--fps", options.number(1.0), 25.0, "frames per second")
    options.value(parser, "--width", options.whole(64, 4096), 640, "of the video")
    what = "auto: MuJoCo's renderer where a GPU draws, else ray casting (default auto)"
    parser.add_argument(
        "--renderer", choices=("auto", "mujoco", "raycast"), default="auto", help=what
    )
    options.path(parser, "--json", help="summary to write")


def _add_viewer(parser) -> None:
    parser.add_argument(
        "--viewer",
        action="store_true",
        help="a page in the browser, with knobs, until Ctrl-C",
    )
    options.value(parser, "--port", options.whole(1024, 65535), 8080, "of the page")
    options.path(parser, "--ghost", metavar="LOG", help="a measured log on the page")


def _add_keys(parser) -> None:
    parser.add_argument(
        "--keys",
        metavar="KEY,KEY",
        help="keyboard: what to press, out of left, down, right, up",
    )
    parser.add_argument(
        "--level",
        choices=tuple(LEVELS),
        help="keyboard: a Sokoban level, its shortest solution pressed key by key",
    )
    what = "keyboard: ask again after a time-out"
    options.value(parser, "--retries", options.whole(0, 10), 0, what)


def _check(args: argparse.Namespace) -> None:
    """Refuses what cannot be played, before JAX loads; reads the log of the ghost."""
    from fingers_mjx.policy.place import check_kind
    from sysid.logs.read import read_log

    if args.policy is None and not args.viewer:
        valid = "a run or an exported bundle, or --viewer"
        raise InputError("play", "POLICY", "nothing", valid)
    args.policy = args.policy or CRAWL_POLICY
    options.check_policy(args)
    if args.then is not None:
        check_kind(args.then)
    if args.keys is not None:
        keys_named(args.keys)
    if args.video and args.video.suffix not in VIDEO_SUFFIXES:
        valid = one_of(VIDEO_SUFFIXES)
        raise InputError("--video", "suffix", args.video.suffix, valid)
    options.check_file("--json", args.json)
    options.check_file("--video", args.video)
    if args.ghost is not None:
        args.ghost = read_log(args.ghost)


def run(args: argparse.Namespace) -> int:
    """Plays; a run that was not exported is, for as long as it takes."""
    from fingers_mjx.export.run import as_bundle

    args.title = args.policy.name  # that of a run, not of the bundle made for it
    with as_bundle(args.policy) as args.policy, as_bundle(args.then) as args.then:
        return _play(args)


def _preview(args: argparse.Namespace) -> str:
    """Returns the settings of the worlds to play in, as a `config.yaml`."""
    from fingers_mjx.policy.trained_in import trained_in
    from fingers_mjx.runs.settings import settings_yaml

    return settings_yaml(_setup(args, trained_in(args.policy)))


def _play(args: argparse.Namespace) -> int:
    """Plays a bundle; the table goes to stdout, progress to stderr."""
    from fingers_mjx.cli.output import keep_summary, print_measures
    from fingers_mjx.evaluation.source import document
    from fingers_mjx.play.episodes import play_episodes, schedule_of
    from fingers_mjx.play.keyboard import KeyPlayer, keys_story
    from fingers_mjx.play.recovery import RecoveryPlayer, is_recovery, story
    from fingers_mjx.policy.source import PolicySource, load_bundle_setup
    from fingers_mjx.training.counting import counting

    if args.viewer:
        return _watch(args)
    bundle, trained = load_bundle_setup(args.policy)
    setup = _setup(args, trained)
    player = _player(args, setup, bundle)
    steps = max(1, round(args.seconds / player.env.dt))
    scheduled = args.commands and not is_recovery(bundle)
    schedule = schedule_of(args.commands, steps) if scheduled else None
    with counting(sys.stderr, "playing", "episodes") as progress:
        played = play_episodes(
            player, args.episodes, steps, args.seed, schedule, progress
        )
    trained_steps = bundle.manifest.provenance.normalizer.steps
    source = PolicySource(args.policy, setup, bundle.network, trained_steps)
    summary = document(source, played.table, args.seed, _conditions(args, played))
    keep_summary(args.json, summary)
    if args.video:
        _film(args, bundle, player, played)
    print_measures(summary)
    if isinstance(player, RecoveryPlayer):
        print("first episode:", story(played.first, player.env.dt, _then_name(args)))
    if isinstance(player, KeyPlayer):
        print("keys:", keys_story(player.results, start_board(args)))
    return 0


def _watch(args: argparse.Namespace) -> int:
    """Serves the page until Ctrl-C."""
    from fingers_mjx.play.viewer.watch import Watched, watch
    from fingers_mjx.policy.source import load_bundle_setup
    from fingers_mjx.training.compile_cache import use_compile_cache

    use_compile_cache()
    bundle, trained = load_bundle_setup(args.policy)
    command = None
    if args.commands and args.then is None:  # the page has sliders for it
        command, args.commands = tuple(args.commands[0]), None
    setup = _setup(args, trained)
    watched = Watched(
        f"{trained.train.task}: {args.title}",
        setup,
        lambda setup: _player(args, setup, bundle),
        args.seed,
        command,
        args.ghost,
    )
    watch(watched, args.port)
    return 0


def _player(args: argparse.Namespace, setup: Setup, bundle: Bundle) -> Player:
    """Returns what plays the bundle; recoveries end as the shim ends them."""
    from fingers_mjx.play.keyboard import KeyPlayer
    from fingers_mjx.play.player import Player
    from fingers_mjx.play.recovery import RecoveryPlayer, check_chain, is_recovery
    from fingers_mjx.policy.source import load_bundle_setup
    from fingers_mjx.runs.setup import make_env

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


def _then_name(args: argparse.Namespace) -> str | None:
    return None if args.then is None else args.then.absolute().name


def _setup(args: argparse.Namespace, trained: Setup) -> Setup:
    """Returns the worlds to play in."""
    from fingers_mjx.evaluation.setups import nominal, with_command, without_practice
    from fingers_mjx.runs.settings import overridden

    setup = overridden(trained if args.randomize else nominal(trained), args.settings)
    setup = without_practice(setup)
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
    from fingers_mjx.play.keyboard_video import write_keyboard_video
    from fingers_mjx.play.video import Film, write_video
    from fingers_mjx.training.counting import counting

    args.video.parent.mkdir(parents=True, exist_ok=True)
    with counting(sys.stderr, "drawing", "frames") as progress:
        film = Film(args.video, args.fps, args.width, progress, args.renderer)
        if bundle.manifest.task == "keyboard":
            write_keyboard_video(film, player.env, played.first, start_board(args))
        else:
            write_video(film, player.env, played.first)


def _conditions(args: argparse.Namespace, played: Session) -> dict[str, Any]:
    """Returns what it takes to repeat it."""
    names = ("seconds", "commands", "keys", "level", "retries", "randomize", "friction")
    return {
        "loop": "C MuJoCo through fingers_deploy",
        "runtime": args.runtime,
        "then": _then_name(args),
        **{name: getattr(args, name) for name in names},
        "settings": args.settings,
        "steps_held": played.held,
    }
