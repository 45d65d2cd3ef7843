"""What must hold between the options of a run, before any process starts."""

import argparse
import importlib.util
import math
from pathlib import Path

from fingers_deploy.bundle import Bundle
from fingers_deploy.errors import InputError
from fingers_robot.behaviour.task_inputs import OBJECT_TERMS, reads


def check_options(options: argparse.Namespace) -> None:
    """Refuses options that contradict one another or that no run can have.

    Raises:
        InputError: naming the option.
    """
    kind = options.driver
    if kind == "sim" and not (options.model or options.socket):
        raise InputError("--driver sim", "", "no model", "--model FILE or --socket")
    if kind == "replay" and not options.log:
        raise InputError("--driver replay", "", "no log", "--log FILE")
    if options.arm and kind == "wuji" and not options.dry_run:
        valid = "typing arm at the console"
        raise InputError("--arm", "", "a real hand", valid)
    check_library(kind)
    if not 50.0 <= options.loop_hz <= 1000.0:
        raise InputError("--loop-hz", "", options.loop_hz, "50 to 1000")
    if not all(abs(stick) <= 1.0 for stick in options.sticks):
        raise InputError("--sticks", "", options.sticks, "numbers from -1 to 1")
    hold = options.heading_hold or ()
    if not all(map(math.isfinite, hold)):
        raise InputError("--heading-hold", "", hold, "finite numbers")
    if not options.joystick_quiet >= 0:
        valid = "0 s (never) or more"
        raise InputError("--joystick-quiet", "", options.joystick_quiet, valid)
    if options.duration is not None and not options.duration > 0:
        raise InputError("--duration", "", options.duration, "above 0 s")
    if not options.no_record and not Path(options.out).is_dir():
        raise InputError("--out", "", options.out, "an existing folder")


def check_sources(options: argparse.Namespace, bundles: list[Bundle]) -> None:
    """Refuses a policy without what it reads, and sources that no policy reads.

    Raises:
        InputError: naming the option.
    """
    interfaces = [b.manifest.interface for b in bundles]
    pushes = any(reads(x, OBJECT_TERMS) for x in interfaces)
    if pushes != bool(options.tracker):
        found = "no path" if pushes else "a path, but no policy that reads a camera"
        valid = "a path for a policy that pushes, none for others"
        raise InputError("--tracker", "", found, valid)
    presses = any(reads(x, ("request",)) for x in interfaces)
    if (options.keys or options.keyboard) and not presses:
        option = "--keys" if options.keys else "--keyboard"
        raise InputError(option, "", "no policy that presses keys", "a keyboard policy")


def check_library(kind: str) -> None:
    """Refuses a driver whose library is not installed.

    Raises:
        InputError: naming the library.
    """
    if kind == "wuji" and importlib.util.find_spec("wujihandpy") is None:
        valid = "pip install wujihandpy, or the extra [hand]"
        raise InputError("--driver wuji", "", "no wujihandpy", valid)
