"""`fingers sysid diagnose`."""

import argparse

from envs.config.atomic_file import write_atomic
from envs.config.typed import load_yaml
from envs.errors import InputError
from envs.hand.hand_file import save_hand_file
from fingers_mjx.cli.diagnose_walk import run_walk, walks
from fingers_mjx.cli.excite import mechanism_of
from sysid.diagnosis.diagnose import examine
from sysid.diagnosis.verdict.hand import extended_hand
from sysid.logs.bag import BagMap
from sysid.logs.read import read_log


def run(args: argparse.Namespace) -> int:
    """Names what the simulation lacks; writes verdict, hand file and report."""
    if args.out.exists() and not args.out.is_dir():
        raise InputError(args.out, "", "a file", "a directory for the results")
    mechanism = mechanism_of(args)
    bag_map = load_yaml(BagMap, args.map) if args.map else None
    logs = [
        read_log(path, bag_map if path.is_dir() or path.suffix == ".mcap" else None)
        for path in args.logs
    ]
    if walks(logs):
        return run_walk(args, logs, mechanism.hand)
    diagnosis, examined = examine(logs, mechanism, args.seed)
    args.out.mkdir(parents=True, exist_ok=True)
    text = diagnosis.to_json() + "\n"
    write_atomic(args.out / "diagnosis.json", text)
    if mechanism.hand is not None and diagnosis.causes:
        save_hand_file(extended_hand(mechanism.hand, diagnosis), args.out / "hand.yaml")
    if not args.no_report:
        from fingers_mjx.reports.diagnosis import write_diagnosis_report

        write_diagnosis_report(args.out / "report.html", diagnosis, examined)
    print(f"{diagnosis.verdict}: {diagnosis.summary}")
    if diagnosis.next_experiment:
        print(diagnosis.next_experiment)
    return 0
