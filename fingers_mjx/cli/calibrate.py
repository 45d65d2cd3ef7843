"""`fingers sysid calibrate`."""

import argparse

from envs.config.typed import load_yaml
from envs.hand.hand_file import save_hand_file
from fingers_mjx.cli.excite import mechanism_of
from sysid.calibration.calibrate import Calibration, calibrate, calibrated_hand
from sysid.calibration.figures import write_figures
from sysid.logs.bag import BagMap
from sysid.logs.read import read_log


def run(args: argparse.Namespace) -> int:
    """Calibrates and writes what was found."""
    mechanism = mechanism_of(args)
    bag_map = load_yaml(BagMap, args.map) if args.map else None
    logs = [read_log(path, bag_map) for path in args.logs]
    found = calibrate(logs, mechanism, tell=print)
    args.out.mkdir(parents=True, exist_ok=True)
    (args.out / "calibration.json").write_text(found.to_json(), encoding="utf-8")
    write_figures(found, args.out)
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
