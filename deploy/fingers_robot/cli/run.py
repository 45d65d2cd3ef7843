"""`fingers-deploy run | record | guard`: from options to a run at the console."""

import argparse
import contextlib
import math
from typing import Any

from fingers_deploy.bundle import Bundle, load_bundle
from fingers_deploy.errors import BundleError, InputError
from fingers_deploy.manifest import Interface
from fingers_robot.behaviour.joystick import QUIET_S
from fingers_robot.behaviour.keyboard.keys import ARROWS
from fingers_robot.behaviour.plan import read_plan
from fingers_robot.cli.console import REFUSED, check_operator, drive
from fingers_robot.cli.options import check_library, check_options, check_sources
from fingers_robot.cli.parser import number, whole
from fingers_robot.cli.speaker import Speaker
from fingers_robot.drivers.open import KINDS
from fingers_robot.drivers.outside import outside_kinds
from fingers_robot.drivers.sim import SimulatorProcess, where_the_palm_is
from fingers_robot.reading import JOINT_COUNT
from fingers_robot.record.log import read_log
from fingers_robot.runtime.guard import guard_hand
from fingers_robot.runtime.launcher import EXIT_UNKNOWN

_RUN = "bundles loop_hz mounting runtime joystick sticks plan keys keyboard tracker"
_DRIVER = "dry_run device socket log side serial imu_bus imu_address imu_mount"
_STDOUT = 1
WIGGLES = {"all": list(range(JOINT_COUNT)), "one": [4], "none": []}


def add_run(commands: Any) -> None:
    """Adds the command `run`."""
    parser = commands.add_parser("run", help="run policies on a hand")
    parser.add_argument("bundles", nargs="+", help="folders or ONNX files")
    _add_driver(parser)
    _add_loop(parser)
    parser.add_argument(
        "--runtime", choices=("auto", "onnxruntime", "numpy"), default="auto"
    )
    parser.add_argument("--joystick", metavar="DEVICE", help="e.g. /dev/input/js0")
    parser.add_argument(
        "--joystick-quiet",
        type=number,
        default=QUIET_S,
        metavar="S",
        help="a stick held out so long without the slightest change counts as a lost "
        "gamepad (2); 0: never, where the device goes away with the radio link",
    )
    parser.add_argument(
        "--sticks", type=number, nargs="*", default=[], help="fixed sticks, −1 to 1"
    )
    parser.add_argument(
        "--heading-hold",
        type=number,
        nargs=2,
        metavar=("GAIN", "OFFSET"),
        help="hold the heading: gain [1/s], constant yaw rate [rad/s]",
    )
    parser.add_argument(
        "--keys", nargs="+", choices=ARROWS, metavar="KEY", help="keyboard: to press"
    )
    parser.add_argument(
        "--keyboard", metavar="DEVICE", help="keyboard: /dev/input/… of its key events"
    )
    parser.add_argument(
        "--tracker", metavar="PATH", help="push: local socket for a camera's samples"
    )
    parser.set_defaults(command=run, plan=None, with_sources=True)


def add_record(commands: Any) -> None:
    """Adds the command `record`."""
    parser = commands.add_parser(
        "record", help="record a hand at rest, or while it follows a plan of targets"
    )
    parser.add_argument("bundles", nargs=1, help="bundle with the hand's joints")
    parser.add_argument("--plan", metavar="CSV", help="columns t and cmd.<joint>")
    _add_driver(parser)
    _add_loop(parser)
    parser.set_defaults(
        command=run,
        runtime="numpy",
        joystick_quiet=QUIET_S,
        sticks=[],
        with_sources=False,
        **dict.fromkeys(("joystick", "heading_hold", "keys", "keyboard", "tracker")),
    )


def add_guard(commands: Any) -> None:
    """Adds the command `guard`."""
    parser = commands.add_parser("guard", help="de-energize a hand, nothing else")
    parser.add_argument("bundles", nargs=1, help="bundle with the hand's joints")
    _add_driver(parser)
    parser.set_defaults(command=guard)


def _check_joints(bundle: Bundle) -> None:
    """Refuses a policy of another hand than the one that this side drives."""
    found = len(bundle.manifest.interface.joint_names)
    if found != JOINT_COUNT:
        where, valid = "interface.joint_names", f"{JOINT_COUNT}, the joints of the hand"
        raise BundleError(bundle.source, where, f"{found} joints", valid)


def run(options: argparse.Namespace) -> int:
    """Runs or records; returns the exit status."""
    check_options(options)
    # Refused here, before any process starts and any device is opened.
    bundles = [load_bundle(path) for path in options.bundles]
    for bundle in bundles:
        _check_joints(bundle)
    if options.with_sources:
        check_sources(options, bundles)
    if options.driver == "replay":
        read_log(options.log)
    if options.plan:
        read_plan(options.plan, bundles[0].manifest.interface)
    if not options.unattended:
        check_operator()
    driver = _driver(options)
    with contextlib.ExitStack() as stack:
        if options.driver == "sim" and not options.socket:
            interface = bundles[0].manifest.interface
            simulator = SimulatorProcess(options.model, interface, seed=options.seed)
            driver["socket"] = stack.enter_context(simulator).path
        heading = options.heading_hold
        plain = {
            **_taken(options, _RUN),
            "driver": driver,
            "record": None if options.no_record else options.out,
            "realtime": not options.no_realtime,
            "wiggle": WIGGLES[options.wiggle],
            "joystick_quiet_s": options.joystick_quiet,
            "heading_hold": heading
            and {"gain": heading[0], "offset_rad_s": heading[1]},
        }
        speaker = Speaker(_STDOUT)
        attended = options.arm, options.duration, options.unattended
        status = drive(plain, speaker, *attended)
        if options.driver == "sim" and status not in (REFUSED, EXIT_UNKNOWN):
            speaker(_distance(driver["socket"], bundles[0].manifest.interface))
        speaker.finish()
        return status


def _distance(socket: str, interface: Interface) -> str:
    """Where the simulated hand is now; its origin is where it stood first."""
    try:
        x, y = where_the_palm_is(socket, interface)
    except OSError:
        return "simulated hand: it has ended"
    away_m = math.hypot(x, y)
    return f"simulated hand: {away_m:.2f} m from the origin (x {x:.2f}, y {y:.2f} m)"


def guard(options: argparse.Namespace) -> int:
    """De-energizes a hand; returns 0 once the hand has confirmed it, else 7."""
    interface = load_bundle(options.bundles[0]).manifest.interface
    check_library(options.driver)
    if options.driver == "sim" and not options.socket:
        raise InputError("--driver sim", "", "no hand", "--socket PATH of a simulator")
    safe, words = guard_hand(_driver(options), interface)
    print(words)
    return 0 if safe else EXIT_UNKNOWN


def _add_driver(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("driver")
    kinds = (*KINDS, *(name for name in outside_kinds() if name not in KINDS))
    group.add_argument("--driver", choices=kinds, required=True)
    group.add_argument("--device", help="of a driver that another package brings")
    group.add_argument("--dry-run", action="store_true", help="never energize")
    group.add_argument("--model", help="sim: MJCF or MJB file of the hand")
    group.add_argument("--socket", help="sim: of a simulator that runs already")
    group.add_argument("--seed", type=whole, default=0, help="sim: of the sensor noise")
    group.add_argument("--log", help="replay: MCAP file of a run")
    group.add_argument("--side", choices=("right", "left"), default="right")
    group.add_argument("--serial", help="wuji: serial number of the hand")
    group.add_argument("--imu-bus", type=whole, default=1, help="wuji: I²C bus")
    group.add_argument("--imu-address", type=whole, default=0x4A, help="wuji")
    group.add_argument(
        "--imu-mount",
        type=number,
        nargs=4,
        default=[1.0, 0.0, 0.0, 0.0],
        metavar=("W", "X", "Y", "Z"),
        help="wuji: orientation of the IMU in the palm frame",
    )


def _add_loop(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("loop")
    group.add_argument("--loop-hz", type=number, default=500.0)
    group.add_argument(
        "--no-realtime", action="store_true", help="do not ask for SCHED_FIFO"
    )
    group.add_argument("--wiggle", choices=tuple(WIGGLES), default="all")
    group.add_argument("--out", default=".", help="folder of the recording")
    group.add_argument("--no-record", action="store_true")
    group.add_argument("--mounting", choices=("free", "palm_fixed"), default="free")
    group.add_argument(
        "--arm",
        action="store_true",
        help="arm at once; only in simulation, replay and dry runs",
    )
    group.add_argument(
        "--unattended",
        action="store_true",
        help="go on where nobody can type a stop or read what is said",
    )
    group.add_argument(
        "--duration",
        type=number,
        metavar="S",
        help="stop after so many seconds, with --arm counted from the first step",
    )


def _driver(options: argparse.Namespace) -> dict[str, Any]:
    return {"kind": options.driver, **_taken(options, _DRIVER)}


def _taken(options: argparse.Namespace, names: str) -> dict[str, Any]:
    """The options that both sides call the same."""
    return {name: getattr(options, name) for name in names.split()}
