"""`fingers sysid calibrate`: Table I of the paper from records on a stand."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.sysid import records

if TYPE_CHECKING:
    from sysid.calibration.calibrate import Calibration


def add(actions) -> None:
    """Adds the action and its arguments."""
    parser = options.command(
        actions,
        "calibrate",
        run,
        "measure stiffness, delay, cutoff, speed and tip friction",
        "Fits Table I to records of a hand on a stand: stiffness, delay, cutoff and "
        "speed of every joint that moves, and the friction of fingertips from loaded "
        "pulls (logs with a setting normal_n and a column force.<finger>). Writes "
        "hand.yaml, calibration.json and pictures.",
    )
    parser.set_defaults(check=records.check)
    records.logs(parser, "logs", nargs="+")
    records.mechanism(parser)
    options.path(parser, "-o", "--out", metavar="DIR", default=Path("calibration"))


def run(args: argparse.Namespace) -> int:
    """Calibrates and writes what was found."""
    from envs.hand.hand_file import save_hand_file
    from sysid.calibration.calibrate import calibrate, calibrated_hand
    from sysid.calibration.plots import write_plots

    mechanism = records.mechanism_of(args)
    found = calibrate(args.records, mechanism, report=print)
    args.out.mkdir(parents=True, exist_ok=True)
    (args.out / "calibration.json").write_text(found.to_json(), encoding="utf-8")
    write_plots(found, args.out)
    if mechanism.hand is not None:
        save_hand_file(calibrated_hand(mechanism.hand, found), args.out / "hand.yaml")
    print("\n".join(_lines(found)))
    print(f"written to {args.out}")
    return 0


def _lines(found: Calibration) -> list[str]:
    """Table I as text."""
    lines = [
        f"stiffness {joint} x {fit.values['stiffness']:.4g} "
        f"({fit.low['stiffness']:.4g} to {fit.high['stiffness']:.4g})"
        for joint, fit in found.joints.items()
    ]
    return lines + [
        f"{name} {e.value:.4g} ({e.low:.4g} to {e.high:.4g}) {e.unit}"
        for name, e in found.shared.items()
    ]
