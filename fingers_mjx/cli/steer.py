"""`fingers steer`: what a policy makes of fixed commands, how it holds a heading."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from fingers_mjx.cli.arguments import options


def add(commands) -> None:
    """Adds the command and its arguments."""
    parser = options.command(
        commands,
        "steer",
        run,
        "measure how a policy follows fixed commands and holds a heading",
        "Measure what a policy makes of fixed commands: straight, turning, on the spot "
        "and at rest; then how the robot's heading controller holds and changes its "
        "heading while it walks.",
    )
    parser.set_defaults(check=_check)
    options.path(parser, "policy", metavar="POLICY", help=options.POLICY_HELP)
    options.episodes(parser, 32)
    options.seed(parser)
    length, gain = options.number(4.0), options.number(0.0)
    options.value(parser, "--seconds", length, 10.0, "length of an episode [s]")
    options.value(parser, "--gain", gain, 4.0, "yaw rate per heading error [1/s]")
    drift = "constant yaw rate of the controller [rad/s]"
    options.value(parser, "--offset", options.number(), 0.0, drift)
    options.backend(parser)
    parser.add_argument(
        "--nominal", action="store_true", help="the nominal hand, without noise"
    )
    options.settings(parser, "a setting of the task such as env.max_roll_deg=40")
    options.path(parser, "--json", help="summary to write")


def _check(args: argparse.Namespace) -> None:
    """Refuses what cannot be measured or kept, before JAX loads."""
    options.check_policy(args)
    options.check_file("--json", args.json)


def run(args: argparse.Namespace) -> int:
    """Measures; the tables go to stdout, progress to stderr."""
    from fingers_mjx.cli.output import keep_summary
    from fingers_mjx.evaluation.setups import nominal
    from fingers_mjx.evaluation.steering.commands import obeyed
    from fingers_mjx.evaluation.steering.heading_hold import held
    from fingers_mjx.evaluation.steering.worlds import Course
    from fingers_mjx.policy.digest import digest
    from fingers_mjx.policy.source import load_source
    from fingers_mjx.reports.page import commit_here
    from fingers_mjx.runs.machine import machine
    from fingers_mjx.runs.setup import overridden
    from fingers_mjx.training.counting import counting
    from fingers_robot.behaviour.heading import HeadingConfig

    course = Course(args.episodes, args.seed, options.backend_of(args), args.seconds)
    source = load_source(args.policy)
    setup = nominal(source.setup) if args.nominal else source.setup
    source = dataclasses.replace(source, setup=overridden(setup, args.settings))
    with counting(sys.stderr, "steering", "steps") as progress:
        commands = obeyed(source, course, progress)
    low, high = setup.env.command.yaw_rate_rps
    gains = HeadingConfig(args.gain, args.offset, low, high)
    with counting(sys.stderr, "holding a heading", "steps") as progress:
        headings = held(source, course, gains, progress)
    _print(source.name, commands, headings)
    conditions = dataclasses.asdict(course) | {"nominal": args.nominal}
    keep_summary(
        args.json,
        {
            "policy": source.name,
            "steps_trained": source.steps_trained,
            "policy_sha256": digest(source.network),
            "machine": machine(),
            "commit": commit_here(),
            "conditions": conditions | {"settings": args.settings},
            "controller": {"gain": args.gain, "offset_rad_s": args.offset},
            "commands": commands,
            "headings": headings,
        },
    )
    return 0


def _print(
    name: str, commands: Sequence[Mapping[str, Any]], headings: Sequence[Mapping]
) -> None:
    """Prints both tables."""
    from fingers_mjx.cli.output import print_table

    number = len(COMMAND)
    rows = [[*(f"{x:+.2f}" for x in row["command"]), *_cells(row)] for row in commands]
    header = [*COMMAND, *(key for key in commands[0] if key != "command")]
    print_table(f"{name}: fixed commands", header, rows, number)
    rows = [[f"{row['step_deg']:+.0f}", *_cells(row)] for row in headings]
    header = ["step [°]", *(key for key in headings[0] if key != "step_deg")]
    print_table(f"{name}: heading held while walking", header, rows)


COMMAND = ("v_x [m/s]", "v_y [m/s]", "yaw rate [rad/s]")
"""Columns of a command."""


def _cells(row: Mapping[str, Any]) -> list[str]:
    """Returns the means of a row with the half width of their intervals."""
    return [_cell(one) for one in row.values() if isinstance(one, Mapping)]


def _cell(summary: Mapping[str, Any]) -> str:
    mean, low, high = (summary[key] for key in ("mean", "low", "high"))
    if mean is None:
        return "–"
    return f"{mean:.3f}" if low is None else f"{mean:.3f} ± {(high - low) / 2:.3f}"
