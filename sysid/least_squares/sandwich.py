"""Standard errors of fits whose residuals are correlated in a way that nobody knows.

Within a block, that is: with H = JᵀJ + Σ⁻¹ and the gradient g_b of every block b

    cov θ̂ = H⁻¹ (n / (n − 1) Σ_b (g_b − ḡ)(g_b − ḡ)ᵀ) H⁻¹,    g_b = J_bᵀ r_b

(sandwich estimator with clusters; Cameron and Miller, "A Practitioner's Guide to
Cluster-Robust Inference", Journal of Human Resources 50(2), 2015).
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import t as student

from sysid.least_squares.fits import Fit


def block_sandwich(
    jacobian: Float[np.ndarray, "r k"],
    residual: Float[np.ndarray, " r"],
    inverse: Float[np.ndarray, "k k"],
    block: Int[np.ndarray, " r"],
) -> Float[np.ndarray, "k k"]:
    """H⁻¹ (n / (n − 1) Σ_b (g_b − ḡ)(g_b − ḡ)ᵀ) H⁻¹ with g_b = J_bᵀ r_b.

    Args:
        jacobian: J, of the weighted residual by the coordinates [1].
        residual: r, weighted: in units of its standard deviation [1].
        inverse: H⁻¹ [1].
        block: number of the block of every residual; n are there.

    Source:
        A. C. Cameron, D. L. Miller, "A Practitioner's Guide to Cluster-Robust
        Inference", Journal of Human Resources 50(2), 2015.
    """
    inside = [block == number for number in np.unique(block)]
    g = np.stack([jacobian[rows].T @ residual[rows] for rows in inside])
    g, count = g - g.mean(0), len(inside)
    return inverse @ (g.T @ g * count / max(count - 1, 1)) @ inverse


def standard_errors(
    fit: Fit, deviation: Float[np.ndarray, " n"], block: Int[np.ndarray, " r"]
) -> tuple[Float[np.ndarray, " k"], float]:
    """σ̂ = √diag(sandwich + H⁻¹ Σ⁻¹ H⁻¹), and how many of them make 95 %.

    A coordinate that moves the residual by less than its standard deviation over one
    unit is not identified: NaN.

    Args:
        fit: a fit whose weighted residual scatters by 1.
        deviation: σ of the prior, for all coordinates [1].
        block: number of the block of every residual.

    Returns:
        Standard errors of the free coordinates [1], and the 97.5 % quantile of
        Student's t with as many degrees of freedom as blocks less coordinates.

    Source:
        As `block_sandwich`; the second term is ours: what the data do not show keeps
        the deviation of its prior.
    """
    j, prior = fit.jacobian, np.diag(deviation[fit.free] ** -2.0)
    inverse = np.linalg.inv(j.T @ j + prior)
    cov = block_sandwich(j, fit.residual, inverse, block) + inverse @ prior @ inverse
    identified = np.sqrt(np.sum(j**2, 0)) > 1.0
    used = len(np.unique(block[fit.residual != 0.0]))
    wide = float(student.ppf(0.975, max(used - len(fit.free), 1)))
    return np.where(identified, np.sqrt(np.diag(cov)), np.nan), wide
