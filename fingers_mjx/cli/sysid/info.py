"""`fingers sysid info`."""

import argparse

from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.sysid import records


def add(actions) -> None:
    """Adds the action and its arguments."""
    parser = options.command(
        actions,
        "info",
        run,
        "show what a log holds",
        "Shows joints, columns, ranges, rates, gaps and clock steps.",
        computes=False,
    )
    parser.set_defaults(needs_jax=False)
    records.logs(parser, "log")


def run(args: argparse.Namespace) -> int:
    """Shows what a measured log holds."""
    from sysid.logs.info import info_lines

    (log,) = records.read([args.log], args.map)
    print("\n".join(info_lines(log)))
    return 0
