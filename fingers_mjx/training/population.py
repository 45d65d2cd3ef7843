"""Who may be trained together: what members of a population must share.

A population is S learners whose worlds are one flat batch of one compiled program.
Seed, networks, optimizer, normalizer, adaptive rate, curriculum counters, reward
weights and the numbers of PPO are each member's own; all else is compiled in.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from envs.config.typed import to_dict
from envs.errors import InputError
from envs.hand.hand_file import hand_yaml
from fingers_mjx.ppo.scalars import OWN_SCALARS
from fingers_mjx.runs.directory import flat
from fingers_mjx.runs.setup import Setup
from fingers_mjx.training.start import FRESH, Start

OWN = {
    "train.seed",
    "train.preset",
    *(f"train.ppo.{name}" for name in OWN_SCALARS),
}
"""Settings of the learner that each member has for itself."""
OWN_OF_TASK = ("env.weights", "env.curriculum_scale", "env.schedule_scale")
"""Those of the task."""


@dataclass(frozen=True)
class Member:
    """One learner of a population.

    Attributes:
        setup: settings and hand.
        run_dir: its run directory.
        start: how it begins.
    """

    setup: Setup
    run_dir: Path
    start: Start = FRESH


def program(setup: Setup) -> dict[str, Any]:
    """Returns, by dotted name, what a member shares with the others of its program."""
    train, env = to_dict(setup.train), to_dict(setup.env) if setup.env else {}
    found = flat({"train": train, "env": env})
    found["hand"] = hand_yaml(setup.hand)
    return {k: v for k, v in found.items() if not _is_own(k)}


def check_population(members: Sequence[Member]) -> None:
    """Checks that one program can train `members`.

    Raises:
        InputError: no member, two in one directory, some that resume beside new ones,
            or one that differs from the first in a setting that is compiled in, naming
            it.
    """
    if not members:
        raise InputError("population", "members", 0, "one or more")
    places = [member.run_dir.absolute() for member in members]
    for place in places:
        if places.count(place) > 1:
            raise InputError("population", "run_dir", place, "one directory a member")
    if len({member.start.resume for member in members}) > 1:
        found, valid = "members that resume and new ones", "one or the other"
        raise InputError("population", "start", found, f"{valid}, in turn")
    first = program(members[0].setup)
    for member in members[1:]:
        other = program(member.setup)
        for name in sorted(first.keys() | other.keys()):
            was, found = first.get(name, "nothing"), other.get(name, "nothing")
            if was != found:
                raise _apart(member, name, found, was)


def _apart(member: Member, name: str, found: Any, was: Any) -> InputError:
    """Returns the error of a member that needs a program of its own."""
    if name == "hand":
        found, was = "another hand", "the hand"
    return InputError(member.run_dir, name, found, f"{was}, as the other members have")


def _is_own(name: str) -> bool:
    """Whether each member has the setting `name` for itself."""
    return name in OWN or name.startswith(OWN_OF_TASK)
