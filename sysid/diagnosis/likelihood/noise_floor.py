"""The noise of a residual without repeats: what neighbouring samples do not share.

An effect moves a residual slowly, or for moments; noise of the readings does not know
its neighbours but for the band. So the second differences of a residual hold the noise
and little else, and the half of them that is smaller hardly knows of moments.
"""

from functools import cache

import numpy as np
from jaxtyping import Bool, Float

from sysid.diagnosis.likelihood.whitening import bulk_deviation
from sysid.diagnosis.measured.resampling import SMOOTH_STEPS
from sysid.diagnosis.replay.band import BAND_STEPS, EVERY


@cache
def _neighbours(order: int, band_steps: float) -> tuple[float, float]:
    """Correlation with the first and second neighbour of white noise in a band.

    The autocorrelation of the k-th derivative of noise behind a Gaussian of width w is
    that of a Gaussian of width √2 w, derived 2k times.
    """
    z = EVERY * np.arange(3) / (np.sqrt(2.0) * np.hypot(band_steps, SMOOTH_STEPS))
    shape = (1.0, 1.0 - z**2, 1.0 - 2.0 * z**2 + z**4 / 3.0)[order]
    _, first, second = shape * np.exp(-0.5 * z**2)
    return float(first), float(second)


def difference_noise(
    series: Float[np.ndarray, "m p"],
    valid: Bool[np.ndarray, "m p"],
    variances: Float[np.ndarray, "3"],
    band_steps: float = BAND_STEPS,
) -> float:
    """s² = median (Δ² r)² / 0.4549 c with c = 6 − 8 ρ₁ + 2 ρ₂.

    At least what the readings are known to make, but no more than most of the residual
    is: of rows that are far apart the noise of the readings is not known.

    Args:
        series: a residual r [N·m].
        valid: where it counts.
        variances: how the noise of the readings enters, by the derivative of the angle
            that it comes with (0: also the effort); their correlations ρ_k in the band
            are mixed by them [(N·m)²].
        band_steps: width of the Gaussian that it has passed beyond the smoothing of all
            channels [steps of the grid].

    Returns:
        s [N·m].

    Source:
        Difference-based variance: T. Gasser, L. Sroka, C. Jennen-Steinmetz, Residual
        variance and residual pattern in nonlinear regression, Biometrika 73(3), 1986;
        with the normalized median absolute deviation.
    """
    total = float(np.sum(variances))
    readings = np.sqrt(total)
    whole = valid[2:] & valid[1:-1] & valid[:-2]
    if whole.sum() < 20:
        return bulk_deviation(series[valid]) if valid.any() else 1.0
    mixed = variances / total if total > 0.0 else np.array([1.0, 0.0, 0.0])
    rho = np.array([_neighbours(k, band_steps) for k in range(3)]).T @ mixed
    share = 6.0 - 8.0 * rho[0] + 2.0 * rho[1]
    second = (series[2:] - 2.0 * series[1:-1] + series[:-2])[whole]
    size = max(bulk_deviation(second) / float(np.sqrt(share)), float(readings))
    return min(size, bulk_deviation(series[valid]))
