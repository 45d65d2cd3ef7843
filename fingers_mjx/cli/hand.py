"""`fingers hand`: its stance, its model, and a hand file from a user's own MJCF."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from envs.config.atomic_file import write_atomic
from envs.errors import InputError
from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.arguments.inputs import check_hand

if TYPE_CHECKING:
    from envs.hand.hand_file import HandFile

STANCE_STARTS = 40
"""Starts with which the stored stance was found."""


def add(commands) -> None:
    """Adds the command and its actions."""
    summary = "look at the hand and its stance, or bring a hand of your own"
    parser = commands.add_parser("hand", help=summary, description=f"L{summary[1:]}.")
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    _add_show(actions)
    _add_stance(actions)
    _add_mjcf(actions)
    _add_import(actions)


def _add_show(actions) -> None:
    parser = options.command(
        actions,
        "show",
        show,
        "draw the stance from four sides",
        "Draws the stance from four sides, with the control frame V, fingertips, pad "
        "normals and support polygon.",
        computes=False,
    )
    parser.set_defaults(check=_check_show)
    options.path(parser, "--out", metavar="DIR", default=Path("hand"))
    options.path(parser, "--hand", help="default: the paper's hand")


def _add_stance(actions) -> None:
    parser = options.command(
        actions,
        "stance",
        stance,
        "search the stance again",
        "Searches the stance, settles it for 4 s and prints it as JSON.",
        computes=False,
    )
    parser.set_defaults(check=_check_file)
    options.seed(parser)
    what = "random starts of the search"
    options.value(parser, "--starts", options.whole(1), STANCE_STARTS, what)
    options.path(parser, "--out", help="instead of stdout")
    options.path(parser, "--hand", help="default: the paper's hand")


def _add_mjcf(actions) -> None:
    parser = options.command(
        actions,
        "mjcf",
        mjcf,
        "write the hand as MJCF",
        "Writes the hand, standing, as one MJCF file: the model for fingers-deploy run "
        "--driver sim, or to look at in any MuJoCo viewer.",
        computes=False,
    )
    parser.set_defaults(check=_check_file, needs_jax=False)
    options.path(parser, "-o", "--out", help="instead of stdout")
    options.path(parser, "--hand", help="default: the paper's hand")


def _add_import(actions) -> None:
    parser = options.command(
        actions,
        "import",
        import_mjcf,
        "make a hand file of an MJCF of your own",
        "Carries an MJCF of a hand over into a hand file for --hand: kinematics, "
        "inertia, limits and gains are its own, collision shapes are fitted to it. "
        "Lists what it lacks. For a hand whose fingers the map names, a stance is "
        "searched.",
        computes=False,
    )
    parser.set_defaults(check=_check_import)
    options.path(parser, "mjcf", metavar="MJCF", help="such as vendor.xml")
    what = "YAML: joints, our names to the model's, or fingers; palm_quat; drive"
    options.path(parser, "--joint-map", help=what)
    options.path(parser, "-o", "--out", required=True, help="hand file")
    options.seed(parser)
    what = "random starts of the search, if there is one"
    options.value(parser, "--starts", options.whole(1), STANCE_STARTS, what)


def _check_show(args: argparse.Namespace) -> None:
    """Refuses what cannot be drawn, before JAX loads and Pillow is asked for."""
    options.check_directory("--out", args.out)
    check_hand(args.hand)


def _check_file(args: argparse.Namespace) -> None:
    """Refuses what is no hand or cannot be written, before JAX loads."""
    options.check_file("--out", args.out)
    check_hand(args.hand)


def _check_import(args: argparse.Namespace) -> None:
    """Refuses files that cannot be imported, before JAX loads; keeps the map."""
    from envs.config.typed import load_yaml
    from envs.hand.importing.files import check_files
    from envs.hand.importing.joint_map import JointMap

    options.check_file("--out", args.out)
    args.map = load_yaml(JointMap, args.joint_map) if args.joint_map else JointMap()
    check_files(args.mjcf)


def show(args: argparse.Namespace) -> int:
    """Draws the stance and prints it in numbers."""
    from PIL import Image

    from envs.hand.stance import stance_of
    from fingers_mjx.pictures.hand import facts, pictures, posed

    hand = _hand(args)
    standing = posed(hand, stance_of(hand))
    for name, value in facts(standing).items():
        print(f"{name:24} {value:8.1f}")
    args.out.mkdir(parents=True, exist_ok=True)
    for name, picture in pictures(standing).items():
        Image.fromarray(picture).save(args.out / f"{name}.png")
        print(f"wrote {args.out / f'{name}.png'}")
    return 0


def stance(args: argparse.Namespace) -> int:
    """Searches the stance."""
    from envs.hand.stance import settle, stance_json
    from envs.hand.stance_search import search_stance

    hand = _hand(args)
    qpos, target = search_stance(hand, args.seed, args.starts)
    return _write(stance_json(settle(hand, qpos, target)), args.out)


def mjcf(args: argparse.Namespace) -> int:
    """Writes the model of the hand."""
    from envs.hand.standing_mjcf import standing_mjcf

    return _write(standing_mjcf(_hand(args)), args.out)


def import_mjcf(args: argparse.Namespace) -> int:
    """Imports, lists what was filled in, and writes the hand file."""
    from envs.hand.hand_file import hand_yaml
    from envs.hand.importing.convert import import_hand
    from envs.hand.stance_search import with_stance

    found = import_hand(args.mjcf, args.map)
    for sentence in found.notes:
        print(sentence)
    hand = found.hand
    if args.map.fingers:
        hand = with_stance(hand, args.seed, args.starts, progress=_progress)
    print(_standing(hand))
    _write(hand_yaml(hand), args.out)
    print(f"wrote {args.out}")
    return 0


def _hand(args: argparse.Namespace) -> HandFile:
    from envs.hand.hand_file import DEFAULT_HAND_FILE, load_hand_file

    return load_hand_file(args.hand or DEFAULT_HAND_FILE)


def _write(text: str, out: Path | None) -> int:
    if out:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(out, text)
    else:
        print(text, end="")
    return 0


def _progress(done: int, starts: int) -> None:
    end = "\n" if done == starts else "\r"
    print(f"stance search: {done} of {starts} starts", end=end, flush=True)


def _standing(hand: HandFile) -> str:
    from envs.hand.stance import stance_of

    whose = "its own" if hand.stance else "the stored"
    try:
        height = 1000 * stance_of(hand).root_pos_w[2]
    except InputError as error:
        return f"does not stand under {whose} joint targets: {error.found}"
    return f"stands under {whose} joint targets, the palm {height:.1f} mm up"
