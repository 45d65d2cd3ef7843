"""`fingers sysid diagnose` on the log of a hand that walks."""

import argparse
import dataclasses
import sys
from collections.abc import Sequence

from envs.config.atomic_file import write_atomic
from envs.errors import InputError
from envs.hand.hand_file import HandFile, save_hand_file
from fingers_mjx.evaluation.source import nominal
from fingers_mjx.ppo.config import preset
from fingers_mjx.runs.setup import Setup, make_env, new_setup
from sysid.diagnosis.verdict.hand import extended_hand
from sysid.logs.log import MeasuredLog
from sysid.walking.diagnose import diagnose_walk
from sysid.walking.hypotheses import whole_hand


def walks(logs: Sequence[MeasuredLog]) -> bool:
    """Whether logs are of a hand that stands free.

    Raises:
        InputError: some are and some are not.
    """
    free = [log.header.mounting == "free" for log in logs]
    if any(free) and not all(free):
        found = ", ".join(log.header.mounting for log in logs)
        raise InputError("LOG", "mounting", found, "palm_fixed or free in all logs")
    return all(free) and bool(free)


def run_walk(
    args: argparse.Namespace, logs: Sequence[MeasuredLog], hand: HandFile | None
) -> int:
    """Names what is wrong with the walk; writes verdict and hand file."""
    if hand is None:
        raise InputError("--mjcf", "", args.mjcf, "the hand, for a log of a walk")
    if len(logs) != 1:
        raise InputError("LOG", "", f"{len(logs)} logs", "one log of a walk")
    if hand.effects:
        names = ", ".join(effect.name for effect in hand.effects)
        raise InputError("--hand", "effects", names, "a hand without effects")
    env = make_env(walk_setup(hand), 1, "cpu")
    diagnosis, _ = diagnose_walk(
        logs[0], env, lambda text: print(text, file=sys.stderr)
    )
    args.out.mkdir(parents=True, exist_ok=True)
    text = diagnosis.to_json() + "\n"
    write_atomic(args.out / "diagnosis.json", text)
    if diagnosis.causes:
        save_hand_file(extended_hand(hand, diagnosis), args.out / "hand.yaml")
    print(f"{diagnosis.verdict}: {diagnosis.summary}")
    if diagnosis.next_experiment:
        print(diagnosis.next_experiment)
    return 0


def walk_setup(hand: HandFile) -> Setup:
    """Returns the crawl of one hand with every effect of a walk at its identity."""
    setup = new_setup(preset("cpu", "crawl"), None)
    return dataclasses.replace(nominal(setup), hand=whole_hand(hand))
