"""`fingers demo`: everything once, on the CPU, into one report."""

import argparse
from pathlib import Path

from fingers_mjx.cli.options import add_command, add_path, check_directory


def add(commands) -> None:
    """Adds the command and its arguments."""
    parser = add_command(
        commands,
        "demo",
        run,
        "see everything once, in minutes, without a GPU",
        "See everything once, in minutes, without a GPU. Evaluates and plays the "
        "committed policy, trains a small one, exports it, and writes one "
        "report.html.",
    )
    add_path(parser, "--out", metavar="DIR", default=Path("demo"))
    add_path(
        parser,
        "--policy",
        metavar="BUNDLE",
        help="bundle to evaluate and play; default: the committed crawl policy",
    )


def run(args: argparse.Namespace) -> int:
    """Runs the demonstration; progress and the place of the report go to stdout."""
    from fingers_mjx.demo.demo import POLICY_DIR, demo

    check_directory("--out", args.out)
    command = f"fingers demo --out {args.out}"
    command += f" --policy {args.policy}" if args.policy else ""
    print(f"report: {demo(args.out, args.policy or POLICY_DIR, [command])}")
    return 0
