"""Tests over seeds: the paired t test, and Holm's correction of several together."""

from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.stats import ttest_1samp


def paired_p(
    difference: Float[np.ndarray, "*studies n"],
) -> Float[np.ndarray, "*studies"]:
    """Paired t test of no mean difference, two-sided: p = P(|T_{n-1}| ≥ |d̄| √n/s) [1].

    NaN below two seeds, and where the differences are equal (s = 0). A permutation of
    signs needs no normal distribution, but with n seeds its p is at least 2/2ⁿ: with
    five it is never below 0.05, with three never below 0.25, however large the
    difference. What the t test pays for other distributions is counted in
    `benchmarks.statistics.coverage`.

    Args:
        difference: one per seed, along the last axis [any unit].

    Source:
        Student, "The probable error of a mean", Biometrika, 1908; `scipy.stats`.
    """
    shape, n = difference.shape[:-1], difference.shape[-1]
    if n < 2:
        return np.full(shape, np.nan)
    steady = np.ptp(difference, axis=-1, keepdims=True) == 0
    # SciPy warns of differences without a spread, whose p is undefined anyway.
    spread = np.where(steady, np.arange(n), difference)
    tested: Any = ttest_1samp(spread, 0.0, axis=-1)
    return np.where(steady[..., 0], np.nan, tested.pvalue)


def holm(p: Float[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
    """p̃_(i) = min(1, max_{j≤i} (m - j + 1) p_(j)), p_(1) ≤ … ≤ p_(m) [1].

    Rejecting where p̃ < α makes one or more false rejections among the m comparisons
    with a probability of at most α, whatever depends on what. A comparison without a p
    (NaN) keeps none, and counts among the m as one that is not rejected.

    Args:
        p: of all comparisons that are read together.

    Source:
        Holm, "A simple sequentially rejective multiple test procedure", Scandinavian
        Journal of Statistics, 1979.
    """
    known = np.where(np.isnan(p), 1.0, p)
    order = np.argsort(known, kind="stable")
    steps = np.maximum.accumulate((len(p) - np.arange(len(p))) * known[order])
    corrected = np.empty(len(p))
    corrected[order] = np.minimum(steps, 1.0)
    return np.where(np.isnan(p), np.nan, corrected)
