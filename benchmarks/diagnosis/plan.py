"""What the battery hides in which record, drawn from a seed and the record's number.

The usual battery has one stand and one rate; the wide one draws every record under
conditions of its own (`hidden.conditions.LEVELS`). In a block of 100 records every
level of every factor comes equally often.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.diagnosis.hidden.cases import RATIOS
from benchmarks.diagnosis.hidden.conditions import LEVELS, Conditions
from benchmarks.diagnosis.hidden.sizes import SCALES
from benchmarks.diagnosis.hidden.truth import OUTSIDE

CATALOGUE = tuple(name for name in SCALES if name not in OUTSIDE)
SHARES = {
    "single": 0.5,
    "none": 0.3,
    "double": 0.08,
    "outside": 0.06,
    "invisible": 0.06,
}
FULL = 700
"""Records of the full battery: 350 single ones (four for each effect and magnitude),
210 without effect."""

BLOCK = 100
"""Records in which all levels of a factor come equally often."""

CLOCK = 2e-4
"""Largest relative error of a record's rate."""

NEEDS_COMPANY = "arm"
"""Rig on which another joint pulls."""


@dataclass(frozen=True)
class Task:
    """What to hide in one record, and under which conditions."""

    number: int
    seed: int
    group: str
    effects: tuple[str, ...]
    magnitude: str
    conditions: Conditions

    @property
    def kind(self) -> str:
        """Kind of the stand."""
        return self.conditions.rig


def plan(seed: int, records: int, effects: tuple[str, ...] = CATALOGUE) -> list[Task]:
    """Draws the tasks; effects and magnitudes take turns in a random order."""
    rng = np.random.default_rng([seed, 2])
    groups = [g for g, share in SHARES.items() for _ in range(round(share * records))]
    groups = groups[:records] + ["single"] * max(records - len(groups), 0)
    rng.shuffle(groups)
    pairs = [(e, m) for e in effects for m in RATIOS]
    singles = _turns(rng, pairs)
    outsiders = _turns(rng, list(OUTSIDE))
    tasks = []
    for number, group in enumerate(groups):
        hidden, magnitude = (), "medium"
        if group == "single":
            name, magnitude = next(singles)
            hidden = (name,)
        elif group == "double":
            # A pair is drawn from different effects; one alone would be a single.
            both = rng.choice(len(effects), 2, replace=False)
            hidden = tuple(effects[i] for i in both)
        elif group == "outside":
            hidden = (next(outsiders),)
        elif group == "invisible":
            hidden, magnitude = ("torque_limit",), "invisible"
        kinds = [SCALES[name].kinds for name in hidden] or [("pendulum", "joint")]
        shared = [k for k in kinds[0] if all(k in other for other in kinds)]
        light = [k for k in shared if k != "finger"] or shared
        usual = Conditions(rig=str(rng.choice(light)))
        tasks.append(_task(seed, number, group, (hidden, magnitude), usual))
    return tasks


def wide_plan(
    seed: int, numbers: Sequence[int], effects: tuple[str, ...] = CATALOGUE
) -> list[Task]:
    """Draws tasks under conditions of their own, each from the seed and its number."""
    blocks = {number // BLOCK for number in numbers}
    drawn = {block: _block(seed, block) for block in blocks}
    tasks = []
    for number in numbers:
        rng = np.random.default_rng([seed, 4, number])
        group, conditions = drawn[number // BLOCK][number % BLOCK]
        conditions = replace(conditions, clock=CLOCK * rng.uniform(-1.0, 1.0))
        hidden = _hidden(rng, group, conditions, effects)
        if "joint_coupling" in hidden[0]:
            conditions = replace(conditions, rig=NEEDS_COMPANY)
        tasks.append(_task(seed, number, group, hidden, conditions))
    return tasks


def redrawn(task: Task, again: int) -> Task:
    """Hides another effect of the same group and magnitude in a record.

    Args:
        task: whose record does not show what is hidden.
        again: how often that was so before.
    """
    rng = np.random.default_rng([task.seed, 6, again])
    same = OUTSIDE if task.group == "outside" else CATALOGUE
    others = [name for name in same if name not in task.effects]
    company = task.conditions.rig == NEEDS_COMPANY
    others = [name for name in others if company or name != "joint_coupling"]
    count = len(task.effects)
    chosen = rng.choice(_possible(task.conditions, others), count, replace=False)
    return replace(task, effects=tuple(map(str, chosen)))


def _possible(conditions: Conditions, effects: Sequence[str]) -> list[str]:
    """What can be hidden; a gain that nobody knows is no effect.

    Nor is viscous friction where damping may have any value and no effort is logged:
    both are a torque that grows with the speed.
    """
    gains = () if conditions.gains == "5 %" else ("stiffness", "damping")
    alike = conditions.gains == "unknown" and not conditions.effort
    left_out = (*gains, "viscous_friction") if alike else gains
    return [name for name in effects if name not in left_out]


def _block(seed: int, block: int) -> list[tuple[str, Conditions]]:
    """Groups and conditions of the records of one block."""
    rng = np.random.default_rng([seed, 5, block])
    groups = [g for g, share in SHARES.items() for _ in range(round(share * BLOCK))]
    columns = [rng.permutation(groups).tolist()]
    for levels in LEVELS.values():
        places = rng.permutation(np.arange(BLOCK) % len(levels))
        columns.append([levels[i] for i in places])
    rows = zip(*columns, strict=True)
    return [(r[0], Conditions(**dict(zip(LEVELS, r[1:], strict=True)))) for r in rows]


def _hidden(
    rng: np.random.Generator, group: str, conditions: Conditions, effects: Sequence[str]
) -> tuple[tuple[str, ...], str]:
    """What to hide and how strong."""
    if group == "none":
        return (), "medium"
    if group == "invisible":
        return ("torque_limit",), "invisible"
    if group == "outside":
        return (str(rng.choice(OUTSIDE)),), "medium"
    possible = _possible(conditions, effects)
    count = 2 if group == "double" else 1
    chosen = rng.choice(possible, count, replace=False)
    magnitude = "medium" if count == 2 else str(rng.choice(list(RATIOS)))
    return tuple(map(str, chosen)), magnitude


def _task(seed: int, number: int, group: str, hidden, conditions: Conditions) -> Task:
    effects, magnitude = hidden
    own_seed = seed * 100_003 + number
    return Task(number, own_seed, group, effects, magnitude, conditions)


def _turns(rng, items: list):
    while True:
        for index in rng.permutation(len(items)):
            yield items[index]
