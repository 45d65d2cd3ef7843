"""Statistics of one evaluation: intervals over its episodes.

They say how well the episodes measure the policies at hand. They say nothing about the
training that made these: another seed makes another policy. Claims about trainings need
several seeds and `fingers_mjx.studies.statistics`.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from envs.errors import InputError

RESAMPLES = 4999


@dataclass(frozen=True)
class Summary:
    """A mean with its spread and its confidence interval.

    Attributes:
        mean: of the defined values; NaN if there are none.
        std: sample standard deviation (n - 1); NaN below two values.
        n: how many values are defined (not NaN).
        low: lower end of the confidence interval of the mean; NaN below two values.
        high: upper end.
        median: half of the defined values are at most this.
        p95: 95 % of the defined values are at most this.
    """

    mean: float
    std: float
    n: int
    low: float
    high: float
    median: float
    p95: float


def summarize(
    values: Float[np.ndarray, " n"], confidence: float = 0.95, seed: int = 0
) -> Summary:
    """x̄ = Σ xᵢ/n, s² = Σ (xᵢ - x̄)²/(n - 1) and the interval of x̄, in the unit of x [1].

    NaN marks a measure that an episode does not define (such as the speed of an episode
    without a speed command) and does not count. The interval is a bias-corrected and
    accelerated bootstrap of the mean. For values that are all 0 or 1 it is Wilson's
    score interval of a proportion, because resampling 256 successes out of 256 says
    nothing about the failure that was not seen.

    Args:
        values: one number per independent unit.
        confidence: coverage of the interval.
        seed: of the resampling.

    Raises:
        InputError: a value is infinite.

    Source:
        Efron, "Better Bootstrap Confidence Intervals", JASA, 1987; Wilson, "Probable
        Inference, the Law of Succession, and Statistical Inference", JASA, 1927.

    Examples:
        Of 16 episodes none failed; that does not show that none will:

        >>> survived = summarize(np.ones(16))
        >>> print(f"{survived.mean:.2f} ({survived.low:.2f}–{survived.high:.2f})")
        1.00 (0.81–1.00)
    """
    if np.isinf(values).any():
        raise InputError("summarize", "values", "infinity", "finite numbers or NaN")
    defined = np.asarray(values, float)[~np.isnan(values)]
    if len(defined) > 1 and np.isin(defined, (0.0, 1.0)).all():
        return _summary(defined, _wilson(defined, confidence))
    return _summary(defined, bootstrap_interval(defined, confidence, seed))


def bootstrap_interval(
    values: Float[np.ndarray, " n"],
    confidence: float = 0.95,
    seed: int = 0,
) -> tuple[float, float]:
    """Low, high = θ*(α₁), θ*(α₂): BCa bootstrap interval of the mean θ [its unit, 1].

    α₁, α₂ are the percentiles of θ over resamples, corrected for bias and skewness; NaN
    below two values. Values that are all equal give an interval of width zero. Where
    leaving one value out never moves the mean in floating point, BCa is undefined (0/0)
    and percentiles are returned.

    Args:
        values: defined numbers, one per independent unit.
        confidence: coverage of the interval.
        seed: of the resampling.

    Source:
        Efron, "Better Bootstrap Confidence Intervals", JASA, 1987; `scipy.stats`.
    """
    if len(values) < 2:
        return np.nan, np.nan
    if np.ptp(values) == 0:
        return float(values[0]), float(values[0])
    from scipy.stats import bootstrap  # a second, for which no reader of files waits

    left_out = [np.delete(values, i).mean() for i in range(len(values))]
    found = bootstrap(
        (values,),
        np.mean,
        confidence_level=confidence,
        n_resamples=RESAMPLES,
        batch=500,
        method="BCa" if np.ptp(left_out) > 0 else "percentile",
        rng=np.random.default_rng(seed),
    ).confidence_interval
    return float(found.low), float(found.high)


def paired_difference(
    ours: Float[np.ndarray, " worlds"],
    other: Float[np.ndarray, " worlds"],
    confidence: float = 0.95,
    seed: int = 0,
) -> Summary:
    """Summarizes dᵢ = oursᵢ - otherᵢ of two policies in the same worlds i, as x [1].

    Worlds are resampled, so the interval is of these two policies and of no other
    training. A world that either side does not define does not count.

    Args:
        ours: one number per world.
        other: the same worlds in the same order.
        confidence: coverage of the interval.
        seed: of the resampling.

    Raises:
        InputError: the two sides differ in length.

    Source:
        Ours; the interval is that of `bootstrap_interval`.

    Examples:
        >>> slow = np.array([0.05, 0.07, 0.06, 0.08])
        >>> found = paired_difference(slow + [0.01, 0.02, 0.01, 0.02], slow)
        >>> print(f"{found.mean:.3f} m/s, {found.low > 0}")
        0.015 m/s, True
    """
    if len(ours) != len(other):
        found, valid = f"{len(other)} worlds", f"{len(ours)} worlds as the first"
        raise InputError("paired_difference", "other", found, valid)
    difference = np.asarray(ours, float) - np.asarray(other, float)
    difference = difference[~np.isnan(difference)]
    return _summary(difference, bootstrap_interval(difference, confidence, seed))


def _summary(defined: np.ndarray, interval: tuple[float, float]) -> Summary:
    count = len(defined)
    mean = float(defined.mean()) if count else np.nan
    spread = float(defined.std(ddof=1)) if count > 1 else np.nan
    halves = np.percentile(defined, (50, 95)).tolist() if count else [np.nan] * 2
    return Summary(mean, spread, count, *interval, *halves)


def _wilson(values: np.ndarray, confidence: float) -> tuple[float, float]:
    from scipy.stats import binomtest

    test = binomtest(int(values.sum()), len(values))
    found = test.proportion_ci(confidence, method="wilson")
    return float(found.low), float(found.high)
