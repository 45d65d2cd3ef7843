"""Steps of Gauss and Newton, also where coordinates have bounds.

Coordinates that compensate each other move together: one that stops at its bound while
the others go on without it leaves the valley in which they were.
"""

import numpy as np
from jaxtyping import Bool, Float


def normal_equations(
    jacobian: Float[np.ndarray, "r k"],
    residual: Float[np.ndarray, " r"],
    away: Float[np.ndarray, " k"],
    deviation: Float[np.ndarray, " k"],
) -> tuple[Float[np.ndarray, "k k"], Float[np.ndarray, " k"]]:
    """H = JᵀJ + Σ⁻¹ and g = Jᵀr + Σ⁻¹(θ − θ⁰), half the curvature and slope of a cost.

    Args:
        jacobian: J, of the weighted residual by the coordinates [1].
        residual: r, weighted: in units of its standard deviation [1].
        away: θ − θ⁰ [1].
        deviation: of the prior, positive; Σ = diag σ² [1].

    Source:
        Textbook Gauss-Newton with a Gaussian prior.
    """
    weight = 1.0 / deviation**2
    hessian = jacobian.T @ jacobian + np.diag(weight)
    return hessian, jacobian.T @ residual + weight * away


def gauss_newton(
    jacobian: Float[np.ndarray, "r k"],
    residual: Float[np.ndarray, " r"],
    away: Float[np.ndarray, " k"],
    deviation: Float[np.ndarray, " k"],
    damping: float = 0.0,
) -> Float[np.ndarray, " k"]:
    """Δθ = −(H + λ diag H)⁻¹ g.

    Args:
        jacobian: J, as in `normal_equations`; so are the next three.
        residual: r.
        away: θ − θ⁰.
        deviation: of the prior.
        damping: λ ≥ 0 of Levenberg and Marquardt; 0 for the step of Gauss and Newton.

    Source:
        D. W. Marquardt, "An Algorithm for Least-Squares Estimation of Nonlinear
        Parameters", Journal of SIAM 11(2), 1963.
    """
    hessian, slope = normal_equations(jacobian, residual, away, deviation)
    return -np.linalg.solve(damped(hessian, damping), slope)


def damped(hessian: Float[np.ndarray, "k k"], damping: float):
    """H + λ diag H."""
    return hessian + damping * np.diag(np.diag(hessian) + 1e-9)


def bounded_step(
    hessian: Float[np.ndarray, "k k"],
    slope: Float[np.ndarray, " k"],
    low: Float[np.ndarray, " k"],
    high: Float[np.ndarray, " k"],
) -> Float[np.ndarray, " k"]:
    """Δ with H_FF Δ_F = −g_F − H_FA Δ_A, where A are those that met a bound.

    Args:
        hessian: H [1].
        slope: g [1].
        low: of the step, at most 0 [1].
        high: of the step, at least 0 [1].

    Returns:
        The step; coordinates that would pass a bound end there, and the others (F) go
        where they are best beside them.

    Source:
        Active set: D. P. Bertsekas, Projected Newton Methods for Optimization Problems
        with Simple Constraints, SIAM Journal on Control and Optimization 20(2), 1982.
    """
    step, moves = np.zeros(len(slope)), np.ones(len(slope), bool)
    while moves.any():
        still = np.where(moves, 0.0, step)
        step = still + solved(hessian, slope + hessian @ still, moves)
        beyond = moves & ((step < low) | (step > high))
        if not beyond.any():
            break
        step, moves = np.clip(step, low, high), moves & ~beyond
    return step


def solved(
    hessian: Float[np.ndarray, "k k"],
    slope: Float[np.ndarray, " k"],
    moves: Bool[np.ndarray, " k"],
) -> Float[np.ndarray, " k"]:
    """Δ_F = −H_FF⁻¹ g_F, zero elsewhere.

    Args:
        hessian: H [1].
        slope: g [1].
        moves: which coordinates F are.

    Source:
        Textbook; of least norm where H does not say more.
    """
    step, inside = np.zeros(len(slope)), hessian[np.ix_(moves, moves)]
    try:
        step[moves] = -np.linalg.solve(inside, slope[moves])
    except np.linalg.LinAlgError:
        step[moves] = -np.linalg.lstsq(inside, slope[moves])[0]
    return step
