"""`fingers demo`: everything once, on the CPU, into one report."""

import argparse
import sys
from functools import partial

from fingers_mjx.cli.output import counting
from fingers_mjx.cli.paths import check_directory
from fingers_mjx.demo.demo import POLICY_DIR, demo
from fingers_mjx.demo.screen import Screen
from fingers_mjx.training.progress import reporter


def run(args: argparse.Namespace) -> int:
    """Runs the demonstration; progress and the place of the report go to stdout."""
    check_directory("--out", args.out)
    policy = args.policy or POLICY_DIR
    screen = Screen(
        say=partial(print, flush=True),
        counting=partial(counting, sys.stdout),
        reporting=partial(reporter, sys.stdout),
    )
    command = f"fingers demo --out {args.out}"
    command += f" --policy {args.policy}" if args.policy else ""
    report = demo(args.out, policy, screen, [command])
    print(f"report: {report}")
    return 0
