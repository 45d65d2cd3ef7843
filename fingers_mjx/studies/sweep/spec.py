"""What a sweep trains: configurations × seeds × stages, read from strict YAML."""

import dataclasses
import re
from dataclasses import dataclass, field
from typing import Any, Literal

from envs.config.typed import limits
from envs.errors import InputError
from fingers_mjx.evaluation.direction import Better
from fingers_mjx.studies.sweep.search import Grid, Overrides, Search

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
"""Names of configurations and stages, which are names of directories."""
OWN_WORDS = ("task", "preset", "seed", "backend")
"""Settings of `fingers train` for which a specification has fields of its own."""

MAX_SEEDS = 4096

_SEEDS: dict[str, Any] = limits("1", 0, 2**32 - 1)
_FREE = {"free": True}
_COUNT = _FREE | limits("1", 1, 2**20)

Seeds = int | tuple[int, ...]
"""A list of seeds, or how many."""


@dataclass(frozen=True)
class Stage:
    """One training of each member.

    Attributes:
        name: of its run directories.
        set: settings of this stage.
        schedules: what the curricula do: "keep" goes on where the stage before ended,
            "restart" begins again, as `fingers train --warm-start` alone does.
    """

    name: str = "train"
    set: Overrides = field(default_factory=dict)
    schedules: Literal["keep", "restart"] = "restart"


@dataclass(frozen=True)
class Evaluation:
    """How the last stage of every member is evaluated, as by `fingers eval`.

    Attributes:
        episodes: number of episodes.
        seed: of worlds, commands and noise; the same for all members.
        backend: physics backend; that of the training if not given.
        set: settings of the task for the evaluation alone.
    """

    episodes: int = field(default=256, metadata=limits("1", 1, 2**20))
    seed: int = field(default=0, metadata=_SEEDS)
    backend: str | None = None
    set: Overrides = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in self.set:
            if not name.startswith("env."):
                valid = "a setting of the task, env.FIELD"
                raise InputError("evaluate", f"set.{name}", name, valid)


@dataclass(frozen=True)
class Promotion:
    """Which configurations are trained on more seeds when all others are done.

    Attributes:
        by: measure of the evaluation, whose mean over the seeds counts; the task's main
            one (the first in `fingers_mjx.evaluation.direction`), if not given.
        top: number of configurations.
        seeds: a list, or how many; a number means so many seeds after the largest of
            the sweep, none of which may be listed. What chose the best says too much
            good of it; new seeds do not.
        better: whether higher or lower is; of measures whose direction is known
            (`fingers_mjx.evaluation.direction`) that one, if not given.
    """

    by: str | None = None
    top: int = field(default=3, metadata=limits("1", 1, 2**20))
    seeds: Seeds = field(default=6, metadata=_SEEDS)
    better: Better | None = None


@dataclass(frozen=True)
class Sweep:
    """A sweep as the user writes it, or with every default resolved.

    Attributes:
        task: registered name.
        preset: base of all settings; by the machine if not given.
        hand: hand file, relative to the specification; the paper's hand if not given.
        backend: physics backend; by the machine if not given.
        warm_start: bundle from which the first stage of every member starts, relative
            to the specification; untrained networks if not given.
        set: settings of all members, by dotted name.
        configurations: name to its settings, among which `hand` may be; they count
            before those of a stage, and those before the ones of all members.
        search: random configurations, besides those with names.
        grid: combinations, besides those with names.
        seeds: a list, or how many, from 0 on.
        stages: trainings in turn, each warm-started from the one before.
        evaluate: how members are evaluated.
        promote: which configurations get more seeds.
        threads: of XLA in each process, on which its last bits depend; if not given,
            one, or all cores with the engine population and with backend warp.
        engine: where members are trained; by the backend if not given.
        processes: members (or programs) at the same time; by the machine if not given.
        address: of a Ray cluster; a cluster of its own on loopback if not given.
        worlds_at_once: most worlds of one program (engine population); by the memory
            of the machine if not given.

    Raises:
        InputError: relative to the specification.
    """

    task: str
    preset: str | None = None
    hand: str | None = None
    backend: str | None = None
    warm_start: str | None = None
    set: Overrides = field(default_factory=dict)
    configurations: dict[str, Overrides] = field(default_factory=dict)
    search: Search | None = None
    grid: Grid | None = None
    seeds: Seeds = field(default=3, metadata=_SEEDS)
    stages: tuple[Stage, ...] = (Stage(),)
    evaluate: Evaluation = field(default_factory=Evaluation)
    promote: Promotion | None = field(default=None, metadata=_FREE)
    threads: int | None = field(default=None, metadata=limits("1", 1, 4096))
    engine: Literal["population", "local", "ray"] | None = field(
        default=None, metadata=_FREE
    )
    processes: int | None = field(default=None, metadata=_COUNT)
    address: str | None = field(default=None, metadata=_FREE)
    worlds_at_once: int | None = field(default=None, metadata=_COUNT)

    def __post_init__(self) -> None:
        _check_names(self)
        _check_seeds("seeds", self.seeds)
        if self.grid is not None and not self.grid:
            raise InputError("sweep", "grid", "no setting", "one or more")
        if self.promote is not None:
            _check_seeds("promote.seeds", self.promote.seeds)
        places = {"set": self.set}
        places |= {f"stages.{n}.set": s.set for n, s in enumerate(self.stages)}
        places |= {f"configurations.{k}": v for k, v in self.configurations.items()}
        for place, overrides in places.items():
            _check_words(place, overrides, hand=place.startswith("configurations."))

    @property
    def repeatable(self) -> bool:
        """Whether a seed always trains the same.

        Sums on a GPU have no fixed order; MJX may run on one, Warp always does.
        """
        return self.backend == "cpu"


def seed_list(seeds: Seeds, after: int = -1) -> tuple[int, ...]:
    """Returns a list of seeds as it is, or so many of them after a number."""
    if isinstance(seeds, tuple):
        return seeds
    return tuple(range(after + 1, after + 1 + seeds))


def free_names() -> set[str]:
    """Returns the fields of `Sweep` that do not change what a member is."""
    return {f.name for f in dataclasses.fields(Sweep) if "free" in f.metadata}


def _check_names(spec: Sweep) -> None:
    """Refuses names that are no names of directories, or are there twice."""
    if not spec.stages:
        raise InputError("sweep", "stages", "no stage", "one or more")
    stages = [stage.name for stage in spec.stages]
    for number, name in enumerate(stages):
        _check_name(f"stages.{number}.name", name)
        if number == 0 and spec.stages[0].schedules == "keep":
            valid = "restart: there is no stage before"
            raise InputError("sweep", "stages.0.schedules", "keep", valid)
        if name in stages[:number]:
            raise InputError("sweep", f"stages.{number}.name", name, "another name")
    for name in spec.configurations:
        _check_name("configurations", name)


def _check_name(place: str, name: str) -> None:
    if not NAME.fullmatch(name):
        valid = "at most 64 letters, digits, dots, dashes and underscores"
        raise InputError("sweep", place, name, valid)


def _check_seeds(place: str, seeds: Seeds) -> None:
    if isinstance(seeds, int) and seeds > MAX_SEEDS:
        raise InputError("sweep", place, seeds, f"at most {MAX_SEEDS}")
    listed = seed_list(seeds)
    if not listed or len(set(listed)) < len(listed):
        found = "no seed" if not listed else "a seed twice"
        raise InputError("sweep", place, found, "one or more different seeds")


def _check_words(place: str, overrides: Overrides, hand: bool) -> None:
    """Refuses to set what the specification has words of its own for."""
    for name in overrides:
        if name in OWN_WORDS or (name == "hand" and not hand):
            valid = f"a setting other than {', '.join(OWN_WORDS)} and hand"
            raise InputError("sweep", f"{place}.{name}", name, valid)
