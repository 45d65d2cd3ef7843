"""`fingers sysid excite`: motions that show what a joint is."""

import argparse
from pathlib import Path

from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.sysid import records


def add(actions) -> None:
    """Adds the action and its arguments."""
    parser = options.command(
        actions,
        "excite",
        run,
        "plan what to record",
        "Plans motions that show what a joint is: targets.csv to play and plan.yaml "
        "with what every part is for, the limits that the model keeps under it, and "
        "which effects it can show and distinguish.",
    )
    parser.set_defaults(check=records.check_arguments)
    records.mechanism(parser)
    parser.add_argument(
        "--joints",
        nargs="+",
        default=[],
        metavar="NAME",
        help="joints one by one, or groups that move together: a finger, flexion, "
        "abduction, pip, dip; default: all joints one by one",
    )
    parser.add_argument(
        "--waves",
        nargs="+",
        metavar="NAME",
        help="slow_triangle small_triangle ramps steps pulses chirp multisine holds; "
        "default: all",
    )
    for name, low, default, what in (
        ("--rate", 1.0, 100.0, "targets in a second"),
        ("--stretch", 0.1, 1.0, "factor on usual lengths"),
        ("--reach", 0.0, 0.5, "largest excursion [rad]"),
        ("--speed", 0.0, 4.0, "largest speed [rad/s]"),
        ("--torque-share", 0.0, 0.9, "largest share of the torque (or current) limit"),
    ):
        options.value(parser, name, options.number(low), default, what)
    options.value(parser, "--repeats", options.whole(1, 100), 3, "of every wave")
    options.seed(parser)
    parser.add_argument(
        "--no-effects",
        action="store_true",
        help="leave out which effects it shows, which takes most of the time",
    )
    options.path(parser, "-o", "--out", metavar="DIR", default=Path("excite"))


def run(args: argparse.Namespace) -> int:
    """Plans an excitation and reports what it shows."""
    from sysid.excitation.check import fitting_plan
    from sysid.excitation.files import separation_lines, write_plan
    from sysid.excitation.plan import Limits, Schedule
    from sysid.excitation.separation import separation
    from sysid.excitation.waves import WAVES
    from sysid.mechanism import joint_groups

    mechanism = records.mechanism_of(args)
    limits = Limits(
        speed_rad_s=args.speed, torque_share=args.torque_share, reach_rad=args.reach
    )
    schedule = Schedule(
        waves=tuple(args.waves or WAVES),
        rate_hz=args.rate,
        repeats=args.repeats,
        stretch=args.stretch,
        seed=args.seed,
    )
    groups = joint_groups(mechanism, args.joints)
    plan, found = fitting_plan(mechanism, groups, schedule, limits)
    shown = []
    for joint in () if args.no_effects else plan.moved:
        shown.append(separation(mechanism, plan, joint))
        print("\n".join(separation_lines(shown[-1])), flush=True)
    write_plan(plan, found, shown, args.out)
    seconds = len(plan.targets) / plan.rate_hz
    print(f"{seconds:.0f} s of targets for {len(plan.moved)} joints in {args.out}")
    return 0
