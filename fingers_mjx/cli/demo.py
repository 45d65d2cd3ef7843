"""`fingers demo`: everything once, on the CPU, into one report."""

import argparse
from pathlib import Path

from fingers_mjx.cli.arguments import options


def add(commands) -> None:
    """Adds the command and its arguments."""
    parser = options.command(
        commands,
        "demo",
        run,
        "see everything once, in minutes, without a GPU",
        "See everything once, in minutes, without a GPU. Evaluates and plays the "
        "committed policy, trains a small one, exports it, and writes one "
        "report.html.",
    )
    parser.set_defaults(check=_check)
    options.path(parser, "--out", metavar="DIR", default=Path("demo"))
    options.path(
        parser,
        "--policy",
        metavar="BUNDLE",
        help="bundle to evaluate and play; default: the committed crawl policy",
    )


def _check(args: argparse.Namespace) -> None:
    """Refuses what cannot be shown, before JAX loads."""
    from fingers_mjx.policy.place import check_kind

    options.check_directory("--out", args.out)
    if args.policy is not None:
        check_kind(args.policy)


def run(args: argparse.Namespace) -> int:
    """Runs the demonstration; progress and the place of the report go to stdout."""
    from fingers_mjx.demo.demo import POLICY_DIR, demo

    command = f"fingers demo --out {args.out}"
    command += f" --policy {args.policy}" if args.policy else ""
    print(f"report: {demo(args.out, args.policy or POLICY_DIR, [command])}")
    return 0
