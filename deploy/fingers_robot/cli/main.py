"""`fingers-deploy check | run | record | guard | log`.

Exit status: 0 it went well, 2 input refused, 5 a fault stopped the hand, 6 not armed,
7 nobody knows whether the hand is off: cut the battery.
"""

import os
import sys
from collections.abc import Sequence

from fingers_deploy.errors import InputError
from fingers_robot.cli.check import add_check
from fingers_robot.cli.log import add_log
from fingers_robot.cli.parser import Parser, UsageError, refuse_empty
from fingers_robot.cli.run import add_guard, add_record, add_run

BAD_INPUT, KEYBOARD = 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; returns the exit status."""
    _fill_closed_handles()
    parser = Parser(prog="fingers-deploy", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for add in (add_check, add_run, add_record, add_guard, add_log):
        add(commands)
    try:
        options = parser.parse_args(arguments)
        refuse_empty(options)
        return options.command(options)
    except (InputError, UsageError) as error:
        print(f"fingers-deploy: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        return KEYBOARD
    except BrokenPipeError:
        # Whoever read what is printed has gone, as `head` does.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _fill_closed_handles() -> None:
    """Opens what was closed of the three standard handles as /dev/null.

    The next file or socket would take its place, and be written to as the terminal.
    """
    for handle in range(3):
        try:
            os.fstat(handle)
        except OSError:
            os.open(os.devnull, os.O_RDWR)


if __name__ == "__main__":
    sys.exit(main())
