"""The policy's process: queries in, answers out, nothing else."""

import contextlib
import json
import socket
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from fingers_deploy.bundle import load_bundle
from fingers_deploy.controller import PolicyController
from fingers_deploy.errors import InputError
from fingers_deploy.manifest import Interface
from fingers_robot.behaviour.command import CommandSource, FixedCommand
from fingers_robot.behaviour.heading import HeadingConfig
from fingers_robot.behaviour.joystick import Joystick
from fingers_robot.behaviour.keyboard.events import Keyboard
from fingers_robot.behaviour.keyboard.runner import KeyRunner
from fingers_robot.behaviour.plan import Plan, read_plan
from fingers_robot.behaviour.policies import Policies
from fingers_robot.behaviour.sources import Sources
from fingers_robot.behaviour.task_inputs import OBJECT_TERMS, reads
from fingers_robot.behaviour.tracker_port import TrackerPort
from fingers_robot.runtime.link import PolicyEnd
from fingers_robot.runtime.realtime import PRIORITY, prefer_this_process
from fingers_robot.runtime.signals import ignore_interrupts

_IDLE_S = 1.0


def make_policies(options: Mapping[str, Any]) -> Policies | Plan:
    """Makes policies and command source from plain options.

    Args:
        options: `bundles` (paths), `runtime`, `sticks` (fixed positions) or `joystick`
            (device) with `joystick_quiet_s` (0: for ever), `heading_hold` (gain and
            offset) or None; `keys` (names), `keyboard` (device) and `tracker` (path of
            a socket) or None; `plan` (file of targets that are played in the place of a
            policy) or None.

    Raises:
        InputError: a bundle or a device is refused.
    """
    if options.get("plan"):
        interface = load_bundle(options["bundles"][0]).manifest.interface
        return Plan(read_plan(options["plan"], interface), interface)
    controllers = tuple(
        PolicyController(load_bundle(path), options["runtime"])
        for path in options["bundles"]
    )
    source: CommandSource
    if options.get("joystick"):
        quiet_s = options["joystick_quiet_s"] or float("inf")
        source = Joystick(options["joystick"], quiet_s=quiet_s)
    else:
        source = FixedCommand(tuple(options.get("sticks") or ()))
    interfaces = [c.bundle.manifest.interface for c in controllers]
    hold, ranges = options.get("heading_hold"), interfaces[0].command_ranges
    config = None
    if hold is not None and len(ranges) == 3:
        low, high = ranges[2]
        config = HeadingConfig(hold["gain"], hold["offset_rad_s"], low, high)
    device = options.get("keyboard")
    keys = KeyRunner(tuple(options.get("keys") or ()), device and Keyboard(device))
    tracker = _tracker(options, interfaces)
    return Policies(controllers, Sources(source, config, keys, tracker))


def _tracker(
    options: Mapping[str, Any], interfaces: Sequence[Interface]
) -> TrackerPort | None:
    """Opens the socket of a camera, where a policy reads what it sees."""
    readers = [x for x in interfaces if reads(x, OBJECT_TERMS)]
    if not readers or not options.get("tracker"):
        return None
    return TrackerPort(options["tracker"], readers[0].v_quat_b)


def serve(link: socket.socket, policies: Policies | Plan) -> None:
    """Answers the newest query until the supervisor goes away."""
    end = PolicyEnd(link)
    while end.open:
        query = end.wait(_IDLE_S)
        if query is not None:
            end.send(policies.answer(query))


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the process: options as JSON and the number of the link's socket."""
    text, handle = sys.argv[1:] if arguments is None else arguments
    ignore_interrupts()
    link = socket.socket(fileno=int(handle))
    try:
        options = json.loads(text)
        policies = make_policies(options)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    prefer_this_process(PRIORITY - 10, ask=bool(options["realtime"]))
    serve(link, policies)
    for line in policies.finish():
        # A terminal that is gone is no reason to fail.
        with contextlib.suppress(OSError):
            print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
