"""`fingers play`: an exported policy in plain C MuJoCo, through the shim."""

import argparse
import dataclasses
import sys
from typing import Any

from envs.errors import InputError, one_of
from fingers_mjx.cli_paths import check_file
from fingers_mjx.cli_progress import counting
from fingers_mjx.cli_table import print_measures
from fingers_mjx.evaluate_files import write_summary
from fingers_mjx.evaluate_source import document, nominal, with_command
from fingers_mjx.play import Player
from fingers_mjx.play_episodes import Session, play_episodes, schedule_of
from fingers_mjx.play_video import VIDEO_SUFFIXES, write_video
from fingers_mjx.policy_source import PolicySource, load_bundle_setup
from fingers_mjx.run_setup import Setup, make_env


def run(args: argparse.Namespace) -> int:
    """Plays; the table goes to stdout, progress to stderr."""
    if args.video and args.video.suffix not in VIDEO_SUFFIXES:
        valid = one_of(VIDEO_SUFFIXES)
        raise InputError("--video", "suffix", args.video.suffix, valid)
    check_file("--json", args.json)
    check_file("--video", args.video)
    bundle, trained = load_bundle_setup(args.bundle)
    setup = _setup(args, trained)
    player = Player(make_env(setup, 1, "cpu"), bundle, args.runtime)
    steps = max(1, round(args.seconds / player.env.dt))
    schedule = schedule_of(args.commands, steps) if args.commands else None
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
        _film(args, player, played)
    print_measures(summary)
    return 0


def _setup(args: argparse.Namespace, trained: Setup) -> Setup:
    """Returns the worlds to play in."""
    setup = trained if args.randomize else nominal(trained)
    if args.commands and len(args.commands) == 1:
        setup = with_command(setup, args.commands[0])
    if args.friction is None:
        return setup
    both = (args.friction, args.friction)
    randomize = dataclasses.replace(setup.env.randomize, tip_friction=both)
    env = dataclasses.replace(setup.env, randomize=randomize)
    return dataclasses.replace(setup, env=env)


def _film(args: argparse.Namespace, player: Player, played: Session) -> None:
    """Draws the first episode."""
    args.video.parent.mkdir(parents=True, exist_ok=True)
    model, dt_s = player.env.mj_model, player.env.dt
    with counting(sys.stderr, "drawing", "frames") as progress:
        write_video(
            args.video, model, played.first, dt_s, args.fps, args.width, progress
        )


def _conditions(args: argparse.Namespace, played: Session) -> dict[str, Any]:
    """Returns what it takes to repeat it."""
    return {
        "loop": "C MuJoCo through fingers_deploy",
        "runtime": args.runtime,
        "seconds": args.seconds,
        "commands": args.commands,
        "randomize": args.randomize,
        "friction": args.friction,
        "steps_held": played.held,
    }
