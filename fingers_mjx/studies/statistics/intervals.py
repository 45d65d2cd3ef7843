"""Intervals over seeds: Student's t for means, BCa bootstrap for means and others."""

import warnings
from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.stats import DegenerateDataWarning, bootstrap, norm, t, trim_mean

CONFIDENCE = 0.95
RESAMPLES = 4999
BATCH = 250
"""Resamples of all studies that are in memory at a time."""
QUARTER = 0.25
FEWEST_RESAMPLED = 3
"""Of two values there are three different resamples: that is no distribution."""

Ends = tuple[Float[np.ndarray, "*studies"], Float[np.ndarray, "*studies"]]


def t_interval(
    values: Float[np.ndarray, "*studies n"], confidence: float = CONFIDENCE
) -> Ends:
    """Low, high = x̄ ∓ t_{n-1} s/√n, the interval of a mean over n seeds [its unit, 1].

    It covers as often as it says for normal values at every n, three seeds included,
    and agrees with the paired t test: it excludes zero where p < 1 - confidence. NaN
    below two values, and for values without any spread, of which nothing follows.

    Args:
        values: one per seed, along the last axis.
        confidence: how often the interval should cover the true mean.

    Source:
        Student, "The probable error of a mean", Biometrika, 1908.
    """
    n = values.shape[-1]
    if n < 2:
        nothing = np.full(values.shape[:-1], np.nan)
        return nothing, nothing
    half = t.ppf(0.5 + confidence / 2, n - 1) * values.std(axis=-1, ddof=1) / np.sqrt(n)
    mean = values.mean(axis=-1)
    return _where_spread(values, mean - half, mean + half)


def bca_interval(
    values: Float[np.ndarray, "*studies n"],
    statistic: Callable = np.mean,
    confidence: float = CONFIDENCE,
) -> Ends:
    """Low, high = θ*(α₁), θ*(α₂): expanded BCa bootstrap of θ over n seeds [unit, 1].

    θ* are the percentiles of θ over resamples of the seeds, never of episodes. With
    z_α = √(n/(n-1)) t_{n-1,α} (`expanded`) in the place of the normal quantile,

        α₁ = Φ(z₀ + (z₀ + z_α) / (1 - a (z₀ + z_α))), and α₂ as α₁ with -z_α,

    where z₀ corrects for bias and a for skewness. NaN below three values, and where a
    is undefined: leaving out a seed never moves θ. No resampled mean is beyond the
    values, which lie on both sides of the median of their distribution with probability
    1 - 2^(1-n): three seeds cover 75 % at most where mean and median agree.
    `benchmarks.statistics.coverage` counts how often an interval covers.

    Args:
        values: one per seed, along the last axis.
        statistic: θ of values along an axis, such as `np.mean`.
        confidence: how often the interval should cover the true value.

    Source:
        Efron, "Better Bootstrap Confidence Intervals", JASA, 1987, by `scipy.stats`;
        levels of Hesterberg, as `expanded`.
    """
    if values.shape[-1] < FEWEST_RESAMPLED:
        nothing = np.full(values.shape[:-1], np.nan)
        return nothing, nothing
    with warnings.catch_warnings(), np.errstate(invalid="ignore", divide="ignore"):
        warnings.simplefilter("ignore", DegenerateDataWarning)
        found = bootstrap(
            (values,),
            statistic,
            n_resamples=RESAMPLES,
            batch=BATCH,
            confidence_level=expanded(confidence, values.shape[-1]),
            method="BCa",
            axis=-1,
            rng=np.random.default_rng(0),
        ).confidence_interval
    return _where_spread(values, found.low, found.high)


def expanded(confidence: float, n: int) -> float:
    """1 - 2α′ with α′ = Φ(√(n/(n-1)) t_{n-1,α}), α = (1 - confidence)/2: wider [1].

    Resamples of n values spread as s √((n-1)/n), and their normal quantiles are not
    Student's: percentiles at α and 1 - α are too close to each other. Those at α′ and
    1 - α′ agree with Student's interval where the resamples are normal.

    Args:
        confidence: how often an interval should cover.
        n: values, two or more.

    Source:
        Hesterberg, "What Teachers Should Know About the Bootstrap", The American
        Statistician 69(4), 2015; his R package `resample` does the same to BCa.
    """
    quantile = np.sqrt(n / (n - 1)) * t.ppf(0.5 - confidence / 2, n - 1)
    return float(1 - 2 * norm.cdf(quantile))


def _where_spread(
    values: Float[np.ndarray, "*studies n"], low: np.ndarray, high: np.ndarray
) -> Ends:
    """Ends of the studies whose values differ; NaN for the others.

    The standard deviation of equal values is not always zero in floating point.
    """
    differ = np.ptp(values, axis=-1) > 0
    return np.where(differ, low, np.nan), np.where(differ, high, np.nan)


def interquartile_mean(
    values: Float[np.ndarray, "*studies n"], axis: int = -1
) -> Float[np.ndarray, "*studies"]:
    """Σ x_(i) / (n - 2k) over i = k+1 … n-k, k = ⌊n/4⌋: mean of the middle half [unit].

    Below four seeds nothing is cut and it is the mean [its unit, 1].

    Args:
        values: one per seed.
        axis: of the seeds.

    Source:
        Agarwal et al., "Deep Reinforcement Learning at the Edge of the Statistical
        Precipice", NeurIPS, 2021, which also averages over tasks; here over seeds.
    """
    return trim_mean(values, QUARTER, axis=axis)
