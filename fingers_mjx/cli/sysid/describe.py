"""`fingers sysid describe`: a first drive.yaml from logs and an MJCF file."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from envs.config.atomic_file import write_atomic
from envs.errors import InputError
from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.sysid import records

if TYPE_CHECKING:
    from sysid.description.proposal import Proposal


def add(actions) -> None:
    """Adds the action and its arguments."""
    parser = options.command(
        actions,
        "describe",
        run,
        "propose a drive.yaml for another mechanism",
        "Looks at records of a mechanism that is not the hand and proposes drive.yaml: "
        "column and unit of the effort, gains with wide tolerances, what can be "
        "examined, each with its reason. On a terminal it asks what no record says.",
    )
    parser.set_defaults(check=_check)
    records.logs(parser, "logs", nargs="+")
    options.path(parser, "--mjcf", required=True, help="masses and axes, as MJCF")
    parser.add_argument(
        "--no-questions", action="store_true", help="as it does without a terminal"
    )
    options.path(parser, "-o", "--out", metavar="FILE", default=Path("drive.yaml"))


def _check(args: argparse.Namespace) -> None:
    """Refuses what cannot be read or written, before JAX loads; keeps the logs."""
    from envs.hand.importing.files import check_files

    options.check_file("-o", args.out)
    if args.out.exists():
        raise InputError(args.out, "", "a file that is there", "a new one, by -o FILE")
    args.records = records.read(args.logs, args.map)
    check_files(args.mjcf)


def run(args: argparse.Namespace) -> int:
    """Writes what is proposed."""
    from sysid.description.describe import describe
    from sysid.description.text import drive_text
    from sysid.mechanism import load_mjcf

    proposals = describe(args.records, load_mjcf(args.mjcf), args.mjcf)
    if sys.stdin.isatty() and not args.no_questions:
        proposals = _asked(proposals)
    text = drive_text(proposals, ", ".join(str(path) for path in args.logs))
    write_atomic(args.out, text)
    print(text, end="")
    given = " ".join(str(path) for path in args.logs)
    print(f"\nfingers sysid diagnose {given} --mjcf {args.mjcf} --drive {args.out}")
    return 0


def _asked(proposals: Sequence[Proposal]) -> list[Proposal]:
    """Asks for what no record says; an empty answer keeps what is proposed."""
    from sysid.description.proposal import QUESTIONS, answered

    result = []
    for made in proposals:
        for field in made.asked:
            prompt = f"{made.joint}: {QUESTIONS[field]}; Enter: {made.why[field]}: "
            while text := _line(prompt):
                try:
                    made = answered(made, field, text)
                    break
                except InputError as error:
                    print(error)
        result.append(made)
    return result


def _line(prompt: str) -> str:
    """Returns what was typed, nothing at the end of the input (Ctrl-D)."""
    try:
        return input(prompt).strip()
    except EOFError:
        print()
        return ""
