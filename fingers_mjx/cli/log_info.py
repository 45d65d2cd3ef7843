"""`fingers sysid info`."""

import argparse

from fingers_mjx.cli.options import add_command
from fingers_mjx.cli.records import add_records, records_of


def add(actions) -> None:
    """Adds the action and its arguments."""
    parser = add_command(
        actions,
        "info",
        run,
        "show what a log holds",
        "Shows joints, columns, ranges, rates, gaps and clock steps.",
    )
    add_records(parser, "log")


def run(args: argparse.Namespace) -> int:
    """Shows what a measured log holds."""
    from sysid.logs.info import info_lines

    (log,) = records_of([args.log], args.map)
    print("\n".join(info_lines(log)))
    return 0
