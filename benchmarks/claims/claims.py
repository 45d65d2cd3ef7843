"""The paper's comparative claims, and what our seeds say of them by a rule."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fingers_mjx.studies.comparison.results import Results
from fingers_mjx.studies.statistics.compare import Difference, difference
from fingers_mjx.studies.statistics.pairs import pair

SEEDS = 12
"""Of every configuration, from 0 on; others, if there are any, are in no claim."""

LOST = ("diverged", "failed")
"""States of members that are left out of their pairs and named: they have no value,
and will have none."""

WALKS_MPS, WALK = 0.05, 10
"""So many members of `ours` reach this task speed if the budget is not too small."""


@dataclass(frozen=True)
class Claim:
    """One difference between two configurations that the paper reports.

    Attributes:
        text: the claim in words.
        ours, other: configurations; the difference is ours less other.
        measure: by name.
        paper: mean difference with its 95 % interval, in the measure's unit; `RAISES`
            where the paper has no figure, None where it says that there is none.
        seeds: of both, from 0 on.
        every: whether it is about every seed, not about their mean.
    """

    text: str
    ours: str
    other: str
    measure: str
    paper: tuple[float, float, float] | None
    seeds: int = SEEDS
    every: bool = False


@dataclass(frozen=True)
class Gap:
    """A member of a claim without a value.

    Attributes:
        configuration: by name.
        seed: of its training.
        reason: what became of it.
        lost: whether there will be none; else the claim waits for it.
    """

    configuration: str
    seed: int
    reason: str
    lost: bool


RAISES = (math.inf, 0.0, math.inf)
"""A difference above zero of which the paper says no more."""

SPEED, FIVE, TILT = (
    "task_speed_mps",
    "five_finger_participation",
    "mean_contact_tilt_deg",
)
PADS, PLANTED = "non_nail_participation", "worst_tip_planting_fraction"
TUNED = "tuned_stock"
"""The setting of the stock rewards that was chosen; see `sweeps`."""

CLAIMS = (
    Claim(
        "The footprint objective makes the hand faster",
        *("ours", "no_footprint", SPEED, (0.0079, 0.0037, 0.0119)),
    ),
    Claim(
        "The footprint objective puts more episodes on five fingers",
        *("ours", "no_footprint", FIVE, RAISES),
    ),
    Claim(
        "The footprint objective shifts contact towards the nails",
        *("ours", "no_footprint", TILT, (8.8, 1.4, 15.9)),
    ),
    Claim(
        "Lift has no effect of its own on speed",
        *("ours", "no_lift", SPEED, None),
    ),
    Claim(
        "Direction has no effect of its own on speed",
        *("ours", "no_direction", SPEED, None),
    ),
    Claim(
        "Lift and direction together have none",
        *("ours", "no_lift_no_direction", SPEED, None),
    ),
    Claim(
        "Without the direction objective more episodes are on five fingers",
        *("no_direction", "ours", FIVE, (0.31, 0.07, 0.52)),
    ),
)
"""Those of the ablation; source: paper, reward-term ablation in simulation."""

MORE_CLAIMS = (
    Claim(
        "Ours is faster than tuned stock",
        *("ours", TUNED, SPEED, (0.0065, 0.0026, 0.0102)),
    ),
    Claim(
        "Tuned stock plants on nails more, in every seed",
        *("ours", TUNED, PLANTED, RAISES),
        every=True,
    ),
    Claim(
        "Ours has more non-nail participation than tuned stock",
        *("ours", TUNED, PADS, (0.35, 0.18, 0.53)),
    ),
    Claim(
        "Doubled footprint plants better than doubled lift",
        *("footprint_2", "lift_2", PLANTED, (0.22, 0.11, 0.33)),
        seeds=6,
    ),
)
"""Those of `tuned_stock` and `weights`, trained after the ablation."""

SMALL = {SPEED: 0.0079}
"""An effect is called none if its interval has zero and nothing as large as this: what
the paper finds of the footprint."""


def measured(claim: Claim, results: Results) -> Difference:
    """Returns the difference that a claim is about, paired over the seeds.

    Args:
        claim: of two configurations.
        results: of a sweep that has both.
    """
    ours, other = (
        _counted(results, name, claim.measure, claim.seeds)
        for name in (claim.ours, claim.other)
    )
    return difference(pair(ours, other), better="higher")


def gaps(claim: Claim, results: Results) -> tuple[Gap, ...]:
    """Returns the members of a claim that have no value, by seed.

    Args:
        claim: of two configurations.
        results: of a sweep that has both.
    """
    pairs = [(s, n) for s in range(claim.seeds) for n in (claim.ours, claim.other)]
    found = [_gap(results, name, seed, claim.measure) for seed, name in pairs]
    return tuple(gap for gap in found if gap is not None)


def _gap(results: Results, name: str, seed: int, measure: str) -> Gap | None:
    """Why a member has no value; None if it has one."""
    own = _counted(results, name, measure)
    if math.isfinite(own.get(seed, math.nan)):
        return None
    if seed in own:
        return Gap(name, seed, f"no episode defines {measure}", lost=True)
    for lacks in results.missing:
        if (lacks.configuration, lacks.seed) == (name, seed):
            return Gap(name, seed, lacks.reason, lost=lacks.state in LOST)
    return Gap(name, seed, "not in the sweep", lost=False)


def verdict(claim: Claim, found: Difference, lacks: Sequence[Gap], void: bool) -> str:
    """Returns "agrees", "disagrees" or why nothing can be said.

    Args:
        claim: as the paper has it.
        found: our difference.
        lacks: its `gaps`.
        void: whether the budget is `too_small`.
    """
    if void:
        return "undecided: the budget is too small"
    if not all(gap.lost for gap in lacks):
        return f"not yet: {found.n} of {claim.seeds} seeds"
    if claim.every and found.n:
        there = found.in_favour == found.n
        return "agrees" if there else f"disagrees: in {found.in_favour} of {found.n}"
    if found.low is None or found.high is None:
        return f"undecided: {found.note}"
    sign = int(np.sign(found.low)) if found.low * found.high > 0.0 else 0
    if claim.paper is None:
        if sign:
            return "disagrees"
        small = max(-found.low, found.high) < SMALL[claim.measure]
        return "agrees" if small else "undecided: the interval is too wide"
    if not sign:
        return "undecided: the interval has zero"
    return "agrees" if sign == np.sign(claim.paper[0]) else "disagrees"


def walkers(results: Results) -> tuple[int, int]:
    """Returns how many members of `ours` reach `WALKS_MPS`, and how many there are.

    Both of the first `SEEDS` seeds alone.

    Args:
        results: of the ablation.
    """
    speeds = _counted(results, "ours", SPEED).values()
    return sum(speed >= WALKS_MPS for speed in speeds), len(speeds)


def too_small(results: Results) -> bool:
    """Whether `WALK` members of `ours` do not walk, whatever those to come will do.

    Args:
        results: of the ablation.
    """
    gaps_of_ours = [_gap(results, "ours", seed, SPEED) for seed in range(SEEDS)]
    coming = [gap for gap in gaps_of_ours if gap and not gap.lost]
    return walkers(results)[0] + len(coming) < WALK


def _counted(
    results: Results, name: str, measure: str, seeds: int = SEEDS
) -> Mapping[int, float]:
    """Seed to value, of the seeds that claims are about."""
    own = results.values.get(name, {}).get(measure, {})
    return {seed: value for seed, value in own.items() if seed in range(seeds)}
