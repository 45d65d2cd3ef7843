"""What a sweep has measured: one value for each member and measure, and what lacks."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from types import MappingProxyType
from typing import Any

from envs.config.json_file import read_table
from envs.errors import InputError
from fingers_mjx.evaluation.files import SUMMARY_FILE
from fingers_mjx.studies.sweep.divergence import trained_anew
from fingers_mjx.studies.sweep.manifest import Manifest, Member, State

ALIKE = ("task", "episodes", "seed", "conditions")
"""What evaluations must share to be compared."""

Evaluated = tuple[Member, dict[str, Any]]
"""A member with its summary."""


@dataclass(frozen=True)
class Missing:
    """A member without a measurement.

    Attributes:
        configuration: by name.
        seed: of its training.
        reason: what became of it.
        state: of the member in the manifest.
    """

    configuration: str
    seed: int
    reason: str
    state: State

    @property
    def name(self) -> str:
        """Configuration and seed."""
        return f"{self.configuration}/{self.seed}"


@dataclass(frozen=True)
class Results:
    """What the members of a sweep measured.

    Attributes:
        task: that all members learn.
        configurations: names, in the order of the specification.
        values: configuration, measure and seed to the mean over the member's episodes;
            NaN where no episode defines it.
        steps: configuration and seed to the control steps behind the policy.
        missing: members without an evaluation.
        conditions: what all evaluations share.
        chose: configuration to the seeds that chose it, which are in none of the above
            (`fingers_mjx.studies.sweep.promote.choosing`).
        anew: configuration to the seeds, among those measured, of which a training
            diverged before the one that counts.
    """

    task: str
    configurations: tuple[str, ...]
    values: Mapping[str, Mapping[str, Mapping[int, float]]]
    steps: Mapping[str, Mapping[int, int]]
    missing: tuple[Missing, ...]
    conditions: Mapping[str, Any]
    chose: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    anew: Mapping[str, tuple[int, ...]] = field(default_factory=dict)

    def seeds(self, configuration: str) -> set[int]:
        """Seeds that the sweep has of a configuration, done or not."""
        lacking = {m.seed for m in self.missing if m.configuration == configuration}
        return lacking | set(self.steps.get(configuration, {}))

    @property
    def members(self) -> int:
        """How many members the sweep has."""
        return len(self.missing) + sum(map(len, self.steps.values()))

    @property
    def measures(self) -> list[str]:
        """Names of the measures that any member defines, sorted."""
        return sorted(
            {
                measure
                for of in self.values.values()
                for measure, seeds in of.items()
                if any(map(math.isfinite, seeds.values()))
            }
        )


def read_results(
    root: Path,
    manifest: Manifest,
    chose: Mapping[str, tuple[int, ...]] = MappingProxyType({}),
) -> Results:
    """Reads the evaluations of all members that are done.

    Args:
        root: directory of the sweep.
        manifest: its members.
        chose: configuration to the seeds that chose it, which are left out.

    Raises:
        InputError: a name that is no name of a directory, or evaluations that were made
            in different ways, such as with other numbers of episodes.
    """
    _check_names(root, manifest)
    found, missing = _evaluations(root, manifest, chose)
    for other in found[1:]:
        _check_alike(root, found[0], other)
    steps: dict[str, dict[int, int]] = {}
    anew: dict[str, tuple[int, ...]] = {}
    for member, summary in found:
        name, seed = member.key
        steps.setdefault(name, {})[seed] = summary["steps_trained"]
        if trained_anew(member.key.directory(root)):
            anew[name] = (*anew.get(name, ()), seed)
    return Results(
        task=manifest.task,
        configurations=manifest.configurations,
        values=_values(found),
        steps=steps,
        missing=tuple(missing),
        conditions={key: found[0][1][key] for key in ALIKE} if found else {},
        chose=chose,
        anew=anew,
    )


def _check_names(root: Path, manifest: Manifest) -> None:
    """Raises InputError for a name that would lead out of the sweep."""
    for name in (*manifest.configurations, *manifest.stages):
        if PurePath(name).name != name:
            raise InputError(root, "name", name, "the name of a directory")


def _evaluations(
    root: Path, manifest: Manifest, chose: Mapping[str, tuple[int, ...]]
) -> tuple[list[Evaluated], list[Missing]]:
    """Returns the members that have an evaluation with it, and those that have none."""
    found, missing = [], []
    for member in manifest.members:
        if member.seed in chose.get(member.configuration, ()):
            continue
        summary = _summary(root, manifest, member)
        if isinstance(summary, str):
            missing.append(Missing(*member.key, summary, member.state))
        else:
            found.append((member, summary))
    return found, missing


def _values(found: Sequence[Evaluated]) -> dict[str, dict[str, dict[int, float]]]:
    """Returns configuration, measure and seed to the mean over episodes."""
    values: dict[str, dict[str, dict[int, float]]] = {}
    for member, summary in found:
        own = values.setdefault(member.configuration, {})
        for measure, value in summary["measures"].items():
            own.setdefault(measure, {})[member.seed] = value
    return values


def _summary(root: Path, manifest: Manifest, member: Member) -> dict[str, Any] | str:
    """Returns the evaluation of a member, or the reason why there is none."""
    if member.state != "done":
        where = f"in {member.stage} after {member.iterations} iterations"
        return f"{member.state} {where}" + (f": {member.reason}" * bool(member.reason))
    run = member.key.directory(root) / manifest.stages[-1]
    try:
        file = run / "eval" / SUMMARY_FILE
        if not file.exists():
            return "done, but without an evaluation"
        found = read_table(file)
        means = {k: _number(v["mean"]) for k, v in found["measures"].items()}
        kept = {key: found[key] for key in (*ALIKE, "steps_trained")}
    except (OSError, ValueError, AttributeError, TypeError, LookupError):
        return "done, but its evaluation cannot be read"
    return {**kept, "measures": means}


def _number(value: float | None) -> float:
    """The mean of a measure; NaN where no episode defines it."""
    return math.nan if value is None else float(value)


def _check_alike(root: Path, first: Evaluated, other: Evaluated) -> None:
    """Raises InputError where two evaluations cannot be compared."""
    for key in ALIKE:
        if first[1][key] != other[1][key]:
            source = f"{root}: evaluation of {other[0].key}"
            valid = f"{first[1][key]}, as of {first[0].key}"
            raise InputError(source, key, other[1][key], valid)
