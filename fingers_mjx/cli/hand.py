"""`fingers hand show`, `fingers hand stance` and `fingers hand mjcf`."""

import argparse
from pathlib import Path

from envs.config.atomic_file import write_atomic
from envs.hand.hand_file import DEFAULT_HAND_FILE, HandFile, load_hand_file
from envs.hand.stance import settle, stance_json, stance_of
from envs.hand.stance_search import search_stance
from envs.hand.standing_mjcf import standing_mjcf
from fingers_mjx.cli.paths import check_directory, check_file


def run(args: argparse.Namespace) -> int:
    """Shows the hand, searches its stance or writes its model."""
    check = check_directory if args.action == "show" else check_file
    check("--out", args.out)
    hand = load_hand_file(args.hand or DEFAULT_HAND_FILE)
    if args.action == "show":
        return _show(hand, args.out)
    if args.action == "mjcf":
        return _write(standing_mjcf(hand), args.out)
    qpos, target = search_stance(hand, args.seed, args.starts)
    return _write(stance_json(settle(hand, qpos, target)), args.out)


def _write(text: str, out: Path | None) -> int:
    if out:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(out, text)
    else:
        print(text, end="")
    return 0


def _show(hand: HandFile, out: Path) -> int:
    from PIL import Image

    from fingers_mjx.pictures.hand import facts, pictures, posed

    standing = posed(hand, stance_of(hand))
    for name, value in facts(standing).items():
        print(f"{name:24} {value:8.1f}")
    out.mkdir(parents=True, exist_ok=True)
    for name, picture in pictures(standing).items():
        Image.fromarray(picture).save(out / f"{name}.png")
        print(f"wrote {out / f'{name}.png'}")
    return 0
