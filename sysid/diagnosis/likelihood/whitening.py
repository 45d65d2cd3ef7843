"""The noise of a residual: estimated as an autoregression, and whitened."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

ORDER = 4
"""Order of the autoregressive noise."""

LONGEST = 20.0
"""Largest number of correlated samples that count as one."""


@dataclass(frozen=True, eq=False)
class Noise:
    """Autoregressive noise of one residual: r_t = Σ a_k r_{t−k} + e_t, e ~ (0, s²).

    Attributes:
        a: a_k [1]; none if the noise is white.
        deviation: s [N·m].
    """

    a: Float[np.ndarray, " k"]
    deviation: float


def whitened(
    r: Float[np.ndarray, "c m p"], valid: Bool[np.ndarray, "m p"], noise: Noise
) -> Float[np.ndarray, "c m p"]:
    """Applies the whitening filter along time: ε_t = (r_t − Σ_k a_k r_{t−k}) / s.

    Args:
        r: residuals of candidates [N·m].
        valid: where they count.
        noise: a_k [1] and s [N·m].

    Returns:
        White residuals [1]; zero where the filter lacks its past.

    Source:
        Inverse filter of an autoregressive noise model: L. Ljung, System
        Identification: Theory for the User, 1999, chapter 3.
    """
    order = len(noise.a)
    out = r.copy()
    for k, a in enumerate(noise.a, 1):
        out[:, k:] -= a * r[:, :-k]
    return np.where(with_past(valid, order), out / noise.deviation, 0.0)


def with_past(valid: Bool[np.ndarray, "m p"], order: int) -> Bool[np.ndarray, "m p"]:
    """Where a sample and its predecessors are valid: w_t = ∧_{k ≤ K} v_{t−k}.

    Args:
        valid: v, where samples are valid.
        order: K, number of predecessors [samples, 1].

    Returns:
        w, false for the first K samples.

    Source:
        Ours.
    """
    whole = valid.copy()
    for k in range(1, order + 1):
        whole[k:] &= valid[:-k]
        whole[:k] = False
    return whole


def bulk_deviation(x: Float[np.ndarray, " n"]) -> float:
    """Standard deviation of most of some values: σ = median |x| / 0.6745.

    Args:
        x: values about zero [N·m]; a few may be outliers.

    Returns:
        Deviation [N·m], > 0.

    Source:
        Normalized median absolute deviation: P. J. Huber, Robust Statistics, 1981.
    """
    return max(float(np.median(np.abs(x))) / 0.6745, 1e-12)


def autoregressive(
    series: Float[np.ndarray, "m p"], valid: Bool[np.ndarray, "m p"]
) -> Noise:
    """Fits r_t = Σ_k a_k r_{t−k} + e_t by least squares, slightly regularized.

    Args:
        series: noise of a residual [N·m].
        valid: where it counts.

    Returns:
        Noise of order `ORDER` [1], [N·m]; white where there are too few samples.

    Source:
        Least-squares estimate of an AR model: L. Ljung, System Identification: Theory
        for the User, 1999, chapter 7.
    """
    whole = with_past(valid, ORDER)
    if whole.sum() < 10 * ORDER:
        return Noise(
            np.zeros(0),
            max(float(np.std(series[valid])), 1e-12) if valid.any() else 1.0,
        )
    rows = np.stack([np.roll(series, k, 0)[whole] for k in range(1, ORDER + 1)], 1)
    y = series[whole]
    gram = rows.T @ rows
    a = np.linalg.solve(gram + 1e-6 * np.trace(gram) * np.eye(ORDER), rows.T @ y)
    innovation = y - rows @ a
    return Noise(a, max(float(np.sqrt(np.mean(innovation**2))), 1e-12))


def correlation_time(
    series: Float[np.ndarray, "m p"], valid: Bool[np.ndarray, "m p"]
) -> float:
    """How many samples count as one, τ = 1 + 2 Σ ρ_k ≤ `LONGEST`, while ρ_k ≥ 0.1.

    Args:
        series: a residual, of any unit.
        valid: where it counts.

    Returns:
        τ ≥ 1 [1].

    Source:
        Variance of the mean of a correlated series: M. S. Bartlett, On the theoretical
        specification and sampling properties of autocorrelated time-series, 1946.
    """
    x = np.where(valid, series, 0.0)
    power = float(np.mean(x[valid] ** 2)) if valid.any() else 0.0
    total = 1.0
    for k in range(1, min(200, len(x) // 4)):
        both = valid[k:] & valid[:-k]
        if both.sum() < 20 or power == 0.0:
            break
        rho = float(np.mean((x[k:] * x[:-k])[both])) / power
        if rho < 0.1:
            break
        total += 2.0 * rho
    return min(total, LONGEST)
