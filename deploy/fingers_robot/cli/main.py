"""`fingers-deploy check | run | record | guard | log`.

Exit status: 0 it went well, 2 input refused, 5 a fault stopped the hand, 6 not armed.
"""

import argparse
import os
import sys
from collections.abc import Sequence

from fingers_deploy.errors import InputError
from fingers_robot.cli.check import add_check
from fingers_robot.cli.log import add_log
from fingers_robot.cli.run import add_guard, add_record, add_run


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; returns the exit status."""
    parser = argparse.ArgumentParser(prog="fingers-deploy", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for add in (add_check, add_run, add_record, add_guard, add_log):
        add(commands)
    options = parser.parse_args(arguments)
    try:
        return options.command(options)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except BrokenPipeError:
        # Whoever read what is printed has gone, as `head` does.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


if __name__ == "__main__":
    sys.exit(main())
