"""`fingers sysid excite`."""

import argparse

from envs.errors import InputError
from envs.hand.hand_file import load_hand_file
from sysid.excitation.check import fitting_plan
from sysid.excitation.files import separation_lines, write_plan
from sysid.excitation.plan import Limits, joint_groups
from sysid.excitation.separation import separation
from sysid.excitation.waves import WAVES
from sysid.mechanism import Mechanism, hand_mechanism, mjcf_mechanism


def run(args: argparse.Namespace) -> int:
    """Plans an excitation and says what it shows."""
    mechanism = mechanism_of(args)
    limits = Limits(
        speed_rad_s=args.speed, torque_share=args.torque_share, reach_rad=args.reach
    )
    plan, found = fitting_plan(
        mechanism,
        joint_groups(mechanism, args.joints),
        waves=args.waves or tuple(WAVES),
        rate_hz=args.rate,
        repeats=args.repeats,
        seed=args.seed,
        limits=limits,
        stretch=args.stretch,
    )
    shown = []
    for joint in () if args.no_effects else plan.moved:
        shown.append(separation(mechanism, plan, joint))
        print("\n".join(separation_lines(shown[-1])), flush=True)
    write_plan(plan, found, shown, args.out)
    seconds = len(plan.targets) / plan.rate_hz
    print(f"{seconds:.0f} s of targets for {len(plan.moved)} joints in {args.out}")
    return 0


def mechanism_of(args: argparse.Namespace) -> Mechanism:
    """Returns the mechanism that the arguments name.

    Raises:
        InputError: an MJCF without drives, drives without an MJCF, or both kinds.
    """
    if (args.mjcf is None) != (args.drive is None) or (args.mjcf and args.hand):
        found = " ".join(f"--{n}" for n in ("hand", "mjcf", "drive") if vars(args)[n])
        raise InputError("arguments", "", found, "--hand, or --mjcf with --drive")
    if args.mjcf is not None:
        return mjcf_mechanism(args.mjcf, args.drive)
    return hand_mechanism(load_hand_file(args.hand) if args.hand else None)
