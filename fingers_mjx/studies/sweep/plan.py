"""From a resolved sweep to the trainings of each member."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from envs.errors import InputError
from fingers_mjx.ppo.config import preset
from fingers_mjx.runs.settings import overridden
from fingers_mjx.studies.sweep.search import Overrides
from fingers_mjx.studies.sweep.spec import Stage, Sweep, seed_list

if TYPE_CHECKING:
    from fingers_mjx.runs.setup import Setup

RUNS = "runs"
SETTINGS = "sweep"
"""What errors name before it is known which file the settings are from."""
LOG_FILE = "log.txt"


class Key(NamedTuple):
    """Which member: a configuration and a seed."""

    configuration: str
    seed: int

    def __str__(self) -> str:
        return f"{self.configuration}/{self.seed}"

    def directory(self, root: Path) -> Path:
        """Returns the directory of the member in a sweep."""
        return root / RUNS / self.configuration / str(self.seed)


@dataclass(frozen=True)
class Training:
    """One stage of one member.

    Attributes:
        path: its run directory.
        setup: settings and hand.
        keep_schedules: whether curricula go on where the stage before ended.
    """

    path: Path
    setup: Setup
    keep_schedules: bool


def keys(spec: Sweep) -> list[Key]:
    """Returns all members of a resolved sweep before promotion, seed by seed.

    So whatever is done after a part of the time has all configurations in it.
    """
    seeds = seed_list(spec.seeds)
    return [Key(name, seed) for seed in seeds for name in spec.configurations]


def trainings(spec: Sweep, root: Path, key: Key) -> list[Training]:
    """Returns the stages of a member in turn.

    Args:
        spec: resolved.
        root: directory of the sweep, in which its hands are.
        key: the member.

    Raises:
        InputError: a setting that does not exist or fit, naming its place in the sweep.
    """
    return [
        Training(
            key.directory(root) / stage.name,
            _setup(spec, root, key, stage),
            stage.schedules == "keep",
        )
        for stage in spec.stages
    ]


def _setup(spec: Sweep, root: Path, key: Key, stage: Stage) -> Setup:
    """Returns the settings of one stage; a configuration's count before a stage's."""
    from fingers_mjx.runs.setup import new_setup

    own = dict(spec.configurations[key.configuration])
    hand = own.pop("hand", spec.hand)
    train = preset(spec.preset or "", spec.task)
    train = dataclasses.replace(train, backend=spec.backend or "", seed=key.seed)
    setup = new_setup(train, root / str(hand) if hand else None)
    places = {
        "set": spec.set,
        f"stages.{stage.name}.set": stage.set,
        f"configurations.{key.configuration}": own,
    }
    return overridden_at(setup, places)


def overridden_at(setup: Setup, places: dict[str, Overrides]) -> Setup:
    """Returns `setup` with settings, those of later places before earlier ones.

    Args:
        setup: what is changed.
        places: place in the sweep to the settings that stand there.

    Raises:
        InputError: names the place in the sweep that a setting came from.
    """
    settings = {name: value for of in places.values() for name, value in of.items()}
    try:
        return overridden(setup, assignments(settings))
    except InputError as error:
        given = [p for p, of in places.items() if _sets(of, error.field)]
        field = ".".join([*given[-1:], error.field])
        raise InputError(SETTINGS, field, error.found, error.valid) from error


def _sets(of: Overrides, field: str) -> bool:
    """Whether settings set a field, a part of it, or what it is a part of."""
    whole = f"{field}."
    return any(whole.startswith(f"{n}.") or n.startswith(whole) for n in of)


def assignments(settings: Overrides) -> list[str]:
    """Returns settings as `--set` takes them; JSON is YAML."""
    return [f"{name}={json.dumps(value)}" for name, value in settings.items()]
