"""One arm over its seeds, and one arm against another: numbers with their reasons."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from fingers_mjx.evaluation.direction import Better
from fingers_mjx.studies.statistics.improvement import probability_of_improvement
from fingers_mjx.studies.statistics.intervals import (
    bca_interval,
    interquartile_mean,
    t_interval,
)
from fingers_mjx.studies.statistics.pairs import Pairs
from fingers_mjx.studies.statistics.power import detectable
from fingers_mjx.studies.statistics.significance import paired_p

ONE_SEED = "one seed per arm proves nothing"
ROUNDING = 1e-12
"""Differences this much closer than the values themselves are rounding."""


@dataclass(frozen=True)
class Arm:
    """One configuration over its seeds; None where a number is undefined.

    Attributes:
        n: seeds with a finite value.
        mean: over them.
        low, high: 95 % interval of the mean, Student's t.
        iqm: interquartile mean.
        iqm_low, iqm_high: its 95 % interval, BCa bootstrap over seeds.
    """

    n: int
    mean: float | None
    low: float | None
    high: float | None
    iqm: float | None
    iqm_low: float | None
    iqm_high: float | None


@dataclass(frozen=True)
class Difference:
    """Ours less the other over the seeds of both; None where undefined.

    Attributes:
        n: seeds of both arms.
        dropped: seeds left out because an arm lacks them.
        mean: mean difference.
        low, high: its 95 % interval, Student's t.
        bca_low, bca_high: its 95 % interval, BCa bootstrap over seeds.
        in_favour: seeds on which ours is better; None if neither direction is better.
        against: seeds on which ours is worse; the rest are ties.
        improvement: probability of improvement, by the better direction.
        p: paired t test, not corrected for other comparisons.
        detectable: smallest difference that n seeds show in 80 % of studies.
        note: why numbers are undefined; empty if all are defined.
    """

    n: int
    dropped: int
    mean: float | None
    low: float | None
    high: float | None
    bca_low: float | None
    bca_high: float | None
    in_favour: int | None
    against: int | None
    improvement: float | None
    p: float | None
    detectable: float | None
    note: str


def arm(values: Float[np.ndarray, " n"]) -> Arm:
    """Returns x̄ = Σ x_i/n and the interquartile mean over seeds [their unit, 1].

    Args:
        values: one per seed; those that are not finite do not count.

    Source:
        `t_interval`, `bca_interval`, `interquartile_mean`.
    """
    values = values[np.isfinite(values)]
    if not len(values):
        return Arm(0, *[None] * 6)
    spread = _without_rounding(values, values)
    low, high = t_interval(spread)
    iqm_low, iqm_high = bca_interval(spread, interquartile_mean)
    return Arm(
        n=len(values),
        mean=_known(values.mean()),
        low=_known(low),
        high=_known(high),
        iqm=_known(interquartile_mean(values)),
        iqm_low=_known(iqm_low),
        iqm_high=_known(iqm_high),
    )


def difference(pairs: Pairs, better: Better | None = None) -> Difference:
    """Returns d̄ = Σ (ours_i - other_i)/n over the seeds i of both [their unit, 1].

    Args:
        pairs: the seeds that both arms have.
        better: which direction is an improvement; None for neither.

    Source:
        `t_interval`, `bca_interval`, `paired_p`, `detectable`,
        `probability_of_improvement`.
    """
    n = len(pairs.seeds)
    both = np.concatenate([pairs.ours, pairs.other])
    values = _without_rounding(pairs.difference, both)
    low, high = t_interval(values)
    bca_low, bca_high = bca_interval(values)
    in_favour, against = _votes(values, better)
    return Difference(
        n=n,
        dropped=len(pairs.dropped),
        mean=_known(values.mean()) if n else None,
        low=_known(low),
        high=_known(high),
        bca_low=_known(bca_low),
        bca_high=_known(bca_high),
        in_favour=in_favour,
        against=against,
        improvement=_known(_improvement(pairs, better)),
        p=_known(paired_p(values)),
        detectable=_known(detectable(_spread(values), n)),
        note=_note(values),
    )


def _without_rounding(
    values: Float[np.ndarray, " n"], scale: Float[np.ndarray, " m"]
) -> Float[np.ndarray, " n"]:
    """Values that are equal but for rounding at the size of `scale`, made equal."""
    if len(values) and np.ptp(values) <= ROUNDING * np.abs(scale).max():
        return np.full(len(values), values[0])
    return values


def _spread(values: Float[np.ndarray, " n"]) -> float:
    """Standard deviation over seeds; NaN without any."""
    differ = len(values) > 1 and np.ptp(values) > 0
    return float(values.std(ddof=1)) if differ else math.nan


def _votes(
    values: Float[np.ndarray, " n"], better: Better | None
) -> tuple[int | None, int | None]:
    """Seeds in favour and against."""
    if better is None:
        return None, None
    signed = values if better == "higher" else -values
    return int((signed > 0).sum()), int((signed < 0).sum())


def _improvement(pairs: Pairs, better: Better | None) -> float:
    if better is None:
        return math.nan
    arms = (pairs.ours, pairs.other)
    return probability_of_improvement(*(arms if better == "higher" else arms[::-1]))


def _note(values: Float[np.ndarray, " n"]) -> str:
    """Why an interval or a test is missing."""
    n = len(values)
    if n == 0:
        return "no seed is in both arms"
    if n == 1:
        return ONE_SEED
    if np.ptp(values) == 0:
        return f"the same difference in all {n} seeds: no spread to infer from"
    if n == 2:
        return "two seeds are too few to resample"
    return ""


def _known(value: float | np.ndarray) -> float | None:
    return float(value) if np.isfinite(value) else None
