"""How late a servo may take its targets, as a record shows it.

A servo looks for a target once a cycle, and at which moment of it no row says: an angle
that moves is uncertain by its speed times a lateness. That is no more than a cycle's;
where a record shows that it is less, no more than that.
"""

import numpy as np
from jaxtyping import Bool, Float

from sysid.diagnosis.replay.timing_uncertainty import CYCLE_S

FAR = 1e12
"""Largest squared error that counts: of what diverges [rad²]."""


def shown_lateness(
    left: Float[np.ndarray, "m p"],
    size: float,
    speed: Float[np.ndarray, "m p"],
    counts: Bool[np.ndarray, "m p"],
) -> float:
    """Deviation of the moments at which targets may have been taken [s].

    What is left of an angle, d, holds at least its noise s and the lateness Δ of
    deviation σ times the speed v:

        E d² ≥ s² + σ² v²,   σ² ≤ Σ (d² − s²) v² / Σ v⁴,   0 ≤ σ ≤ `CYCLE_S`

    by least squares of d² on v². Repeats at the same phase leave no more than these;
    what all of them are late by alike is a delay.

    Args:
        left: d, difference of repeats of the variance of one, or error of a model
            [rad].
        size: s [rad].
        speed: |v| of the angle [rad/s].
        counts: where d counts.

    Returns:
        σ [s]; `CYCLE_S` where nothing moves.

    Source:
        Ours; moments of a variance that is linear in v² (T. Amemiya, A note on a
        heteroscedastic model, Journal of Econometrics 6(3), 1977).
    """
    square = speed[counts] ** 2
    if not np.any(square > 0.0):
        return CYCLE_S
    excess = np.minimum(left[counts] ** 2, FAR) - size**2
    variance = float(excess @ square) / float(square @ square)
    return min(float(np.sqrt(max(variance, 0.0))), CYCLE_S)
