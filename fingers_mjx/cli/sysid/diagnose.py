"""`fingers sysid diagnose`: what the simulation lacks, of a stand or of a walk."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from envs.config.atomic_file import write_atomic
from envs.errors import InputError
from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.sysid import records

if TYPE_CHECKING:
    from envs.hand.hand_file import HandFile
    from fingers_mjx.runs.setup import Setup
    from sysid.logs.log import MeasuredLog
    from sysid.result import Diagnosis


def add(actions) -> None:
    """Adds the action and its arguments."""
    parser = options.command(
        actions,
        "diagnose",
        run,
        "name what the simulation lacks",
        "Compares records with the simulation and names the effects that it lacks: "
        "OUT/diagnosis.json, OUT/report.html and, for the hand, OUT/hand.yaml with "
        "the effects in it.",
    )
    parser.set_defaults(check=records.check)
    records.logs(parser, "logs", nargs="+")
    records.mechanism(parser)
    options.seed(parser)
    parser.add_argument(
        "--no-report", action="store_true", help="without OUT/report.html"
    )
    options.path(parser, "-o", "--out", metavar="OUT", default=Path("diagnosis"))


def run(args: argparse.Namespace) -> int:
    """Names what the simulation lacks; writes verdict, hand file and report."""
    from fingers_mjx.training.compile_cache import use_compile_cache
    from sysid.diagnosis.diagnose import examine
    from sysid.diagnosis.whole_loops import compile_loops_whole

    use_compile_cache()
    mechanism, logs = records.mechanism_of(args), args.records
    if _walks(logs):
        hand = _without_effects(mechanism.hand, args, logs)
        return _write(args.out, _diagnosed_walk(logs[0], hand), hand)
    compile_loops_whole()
    diagnosis, examined = examine(logs, mechanism, args.seed)
    _write(args.out, diagnosis, mechanism.hand)
    if not args.no_report:
        from fingers_mjx.reports.diagnosis import write_diagnosis_report

        write_diagnosis_report(args.out / "report.html", diagnosis, examined)
    return 0


def walk_setup(hand: HandFile) -> Setup:
    """Returns the crawl of one hand with every effect of a walk at its identity."""
    from fingers_mjx.evaluation.setups import nominal
    from fingers_mjx.ppo.config import preset
    from fingers_mjx.runs.setup import new_setup
    from sysid.walking.hypotheses import whole_hand

    setup = new_setup(preset("cpu", "crawl"), None)
    return dataclasses.replace(nominal(setup), hand=whole_hand(hand))


def _walks(logs: Sequence[MeasuredLog]) -> bool:
    """Whether logs are of a hand that stands free.

    Raises:
        InputError: some are and some are not.
    """
    free = [log.header.mounting == "free" for log in logs]
    if any(free) and not all(free):
        found = ", ".join(log.header.mounting for log in logs)
        raise InputError("LOG", "mounting", found, "palm_fixed or free in all logs")
    return all(free) and bool(free)


def _without_effects(
    hand: HandFile | None, args: argparse.Namespace, logs: Sequence[MeasuredLog]
) -> HandFile:
    """Returns the hand of one log of a walk, or refuses."""
    if hand is None:
        raise InputError("--mjcf", "", args.mjcf, "the hand, for a log of a walk")
    if len(logs) != 1:
        raise InputError("LOG", "", f"{len(logs)} logs", "one log of a walk")
    if hand.effects:
        names = ", ".join(effect.name for effect in hand.effects)
        raise InputError("--hand", "effects", names, "a hand without effects")
    return hand


def _diagnosed_walk(log: MeasuredLog, hand: HandFile) -> Diagnosis:
    from fingers_mjx.runs.setup import make_env
    from sysid.walking.diagnose import diagnose_walk

    env = make_env(walk_setup(hand), 1, "cpu")
    return diagnose_walk(log, env, lambda text: print(text, file=sys.stderr))[0]


def _write(out: Path, diagnosis: Diagnosis, hand: HandFile | None) -> int:
    """Writes and prints the verdict, and the hand with the effects in it."""
    from envs.hand.hand_file import save_hand_file
    from sysid.diagnosis.verdict.hand import extended_hand
    from sysid.diagnosis.verdict.wording import probable

    out.mkdir(parents=True, exist_ok=True)
    write_atomic(out / "diagnosis.json", diagnosis.to_json() + "\n")
    if hand is not None and diagnosis.causes:
        save_hand_file(extended_hand(hand, diagnosis), out / "hand.yaml")
    print(f"{diagnosis.verdict}: {diagnosis.summary}")
    for joint, words, probability in probable(diagnosis.posterior):
        print(f"  {joint}: {words}, {probability:.0%}")
    if diagnosis.next_experiment:
        print(diagnosis.next_experiment)
    return 0
