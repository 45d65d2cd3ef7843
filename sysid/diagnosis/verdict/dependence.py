"""Whether what is left of the motion depends on where the joint is.

Noise of readings does not know the position. The force of a worn tooth, of a cable
that runs slack or of a detent does: over the range of a motion it makes waves of the
residual, however small they are beside the noise. Time and speed are not asked so: what
a simulation of steps and dry friction errs by comes with them in records in which
nothing is hidden. And where a joint is held, friction leaves an offset that is that of
the visit: what depends on the position comes again on the next one.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from sysid.diagnosis.likelihood.whitening import correlation_time

WAVES = np.arange(1.0, 16.5, 0.5)
"""Numbers of waves over the range of a motion that are looked for, in steps of a half:
what lies between two whole ones would be seen by neither."""

UNLIKELY = 1e-5
"""Probability of so strong a wave in noise above which it is noise: records hold twenty
joints, and residuals are not quite what noise is taken for."""

LEAST_SHARE = 0.05
"""Least share of what is left that a wave must make up to matter."""

_FEWEST = 50
_TERMS = 3


def depends_on(
    left: Float[np.ndarray, "m p"],
    position: Float[np.ndarray, "m p"],
    valid: Bool[np.ndarray, "m p"],
) -> bool:
    """Whether a residual has a wave over the position that noise would not have.

    For the one of K numbers k of waves over the range of x whose sum Σ e exp(2π i k x)
    is largest, least squares leave r of

        e = c + a cos(2π k x) + b sin(2π k x) + r

    With N samples of which τ count as one,

        Λ = N / (2 τ) · ln(Σ (e − ē)² / Σ r²)

    is in noise at most the largest of K exponential variables: P(Λ > λ) ≤ K e^−λ. The
    same is asked of the means over visits, stretches within a quarter of a wave.

    Args:
        left: e, a residual, of any unit.
        position: x, which must not hold the noise of e, of any unit.
        valid: where the residual counts.

    Returns:
        Whether K e^−Λ is below `UNLIKELY` by samples and by visits, and the share of
        Σ (e − ē)² that is the wave's above `LEAST_SHARE`.

    Source:
        Periodogram of unevenly sampled data and the significance of its largest peak:
        J. D. Scargle, Studies in astronomical time series analysis II, Astrophysical
        Journal 263, 1982; with Bartlett's count of samples. Visits are ours.
    """
    e, x = left[valid], position[valid]
    if len(e) < _FEWEST or np.ptp(x) == 0.0:
        return False
    away = (position - x.min()) / np.ptp(x)
    waves = np.exp(2j * np.pi * WAVES[:, None] * away[valid])
    k = int(np.argmax(np.abs(waves @ (e - e.mean()))))
    terms = np.stack([np.ones_like(x), waves[k].real, waves[k].imag], 1)
    rest = np.zeros(left.shape)
    rest[valid], share = _fitted(e, terms, np.ones_like(x))
    if share < LEAST_SHARE:
        return False
    by_samples = len(e) / correlation_time(rest, valid) * _log_fall(share)
    least = min(by_samples, _by_visits(e, terms, _visits(away, WAVES[k])[valid]))
    return bool(len(WAVES) * np.exp(-0.5 * least) < UNLIKELY)


def _by_visits(e: np.ndarray, terms: np.ndarray, visit: np.ndarray) -> float:
    """2 Λ of the means over visits, each with the weight n of its samples.

    They count as (Σ n)² / Σ n² alike ones (L. Kish, Survey Sampling, 1965).
    """
    _, visit, counts = np.unique(visit, return_inverse=True, return_counts=True)
    alike = len(e) ** 2 / float(np.sum(counts**2))
    if alike <= _TERMS:
        return 0.0
    mean = np.bincount(visit, e) / counts
    shape = np.stack([np.bincount(visit, t) / counts for t in terms.T], 1)
    _, share = _fitted(mean, shape, np.sqrt(counts))
    return (alike - _TERMS) * _log_fall(share)


def _log_fall(share: float) -> float:
    """Logarithm of the squared error before a wave over that behind it."""
    return -float(np.log(max(1.0 - share, 1e-300)))


def _fitted(y: np.ndarray, terms: np.ndarray, root: np.ndarray):
    """Errors of a fit, times the roots of weights, and the share that is the fit's."""
    near = np.linalg.lstsq(terms * root[:, None], y * root, rcond=None)[0]
    mean = np.average(y, weights=root**2)
    rest, whole = (y - terms @ near) * root, float(np.sum(((y - mean) * root) ** 2))
    return rest, 1.0 - float(rest @ rest) / whole if whole > 0.0 else 0.0


def _visits(away: Float[np.ndarray, "m p"], waves: float) -> Int[np.ndarray, "m p"]:
    """Numbers the stretches of every piece that stay within a quarter of a wave."""
    cell = np.floor(4.0 * waves * away)
    begins = np.ones(away.shape, bool)
    begins[1:] = cell[1:] != cell[:-1]
    return np.cumsum(begins.T).reshape(begins.T.shape).T
