"""Whether what is left of the motion depends on where the joint is.

Noise of readings does not know the position. The force of a worn tooth, of a cable
that runs slack or of a detent does: over the range of a motion it makes waves of the
residual, however small they are beside the noise. Time and speed are not asked so: what
a simulation of steps and dry friction errs by comes with them in records in which
nothing is hidden.
"""

import numpy as np
from jaxtyping import Bool, Float

from sysid.diagnosis.likelihood.whitening import correlation_time

WAVES = np.arange(1.0, 16.5, 0.5)
"""Numbers of waves over the range of a motion that are looked for, in steps of a half:
what lies between two whole ones would be seen by neither."""

UNLIKELY = 1e-6
"""Probability of so strong a wave in noise above which it is noise: records hold twenty
joints, and residuals are not quite what noise is taken for."""

LEAST_SHARE = 0.05
"""Least share of the noise's variance that a wave must have to matter."""

_FEWEST = 50


def depends_on(
    left: Float[np.ndarray, "m p"],
    position: Float[np.ndarray, "m p"],
    valid: Bool[np.ndarray, "m p"],
) -> bool:
    """Whether a residual has a wave over the position that noise would not have.

    For K numbers k of waves over the range of x, least squares leave r of

        e = c + a cos(2π k x) + b sin(2π k x) + r

    With N samples of which τ count as one,

        Λ = N / (2 τ) · max_k ln(Σ (e − ē)² / Σ r²)

    is in noise at most the largest of K exponential variables: P(Λ > λ) ≤ K e^−λ.

    Args:
        left: e, a residual in units of its noise [1].
        position: x, of any unit.
        valid: where the residual counts.

    Returns:
        Whether K e^−Λ is below `UNLIKELY`, and the wave above `LEAST_SHARE`.

    Source:
        Least-squares periodogram of unevenly sampled data and the significance of its
        largest peak: J. D. Scargle, Studies in astronomical time series analysis II,
        Astrophysical Journal 263, 1982; with Bartlett's count of samples.
    """
    e, x = left[valid], position[valid]
    if len(e) < _FEWEST or np.ptp(x) == 0.0:
        return False
    e = e - e.mean()
    phase = 2j * np.pi * WAVES[:, None] * (x - x.min()) / np.ptp(x)
    waves = np.exp(phase)
    wave = waves[np.argmax(np.abs(waves @ e))]
    terms = np.stack([np.ones_like(x), wave.real, wave.imag], 1)
    rest = np.zeros_like(left)
    rest[valid] = e - terms @ np.linalg.lstsq(terms, e, rcond=None)[0]
    whole, less = float(e @ e), float(rest[valid] @ rest[valid])
    if whole - less < LEAST_SHARE * len(e):
        return False
    alike = correlation_time(rest, valid)
    unlikely = 0.5 * len(e) / alike * np.log(whole / max(less, 1e-300 * whole))
    return bool(len(WAVES) * np.exp(-unlikely) < UNLIKELY)
