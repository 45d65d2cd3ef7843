"""Steps of Gauss and Newton, also where coordinates have bounds.

Coordinates that compensate each other move together: one that stops at its bound while
the others go on without it leaves the valley in which they were.
"""

import numpy as np
from jaxtyping import Bool, Float

MOST_CHANGES = 4
"""Changes of the active set after which a step is taken as it is [coordinates]."""

LEAST_GAIN = 1e-9
"""Gain of a cost below which a coordinate stays at its bound [1]."""


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
    """Δ = argmin ½ Δᵀ H Δ + gᵀ Δ within low ≤ Δ ≤ high.

    Args:
        hessian: H [1].
        slope: g [1].
        low: of the step, at most 0 [1].
        high: of the step, at least 0 [1].

    Returns:
        The step; coordinates that meet a bound stop there, the others go where they are
        best beside them, and one that would leave its bound again for that does.

    Source:
        Primal active set: J. Nocedal, S. J. Wright, Numerical Optimization, 2006,
        section 16.5. Where coordinates compensate each other many pass their bounds
        together at first, of which few are met at the end.
    """
    step, moves = np.zeros(len(slope)), np.ones(len(slope), bool)
    for _ in range(MOST_CHANGES * len(slope)):
        way = solved(hessian, slope + hessian @ step, moves)
        share = _room(step, way, low, high)
        if share.min(initial=1.0) < 1.0:
            stops = int(np.argmin(share))
            step = np.clip(step + share[stops] * way, low, high)
            step[stops] = (high if way[stops] > 0.0 else low)[stops]
            moves[stops] = False
            continue
        step = np.clip(step + way, low, high)
        gain = _gain_of_leaving(hessian, slope + hessian @ step, step, low, high)
        gain = np.where(moves, 0.0, gain)
        if not gain.max(initial=0.0) > 0.0:
            break
        moves[np.argmax(gain)] = True
    return step


def _room(step, way, low, high) -> Float[np.ndarray, " k"]:
    """Returns the shares of a way after which coordinates meet their bounds."""
    end = np.where(way > 0.0, high, low)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(way == 0.0, np.inf, (end - step) / way)
    return np.maximum(share, 0.0)


def _gain_of_leaving(hessian, slope, step, low, high) -> Float[np.ndarray, " k"]:
    """Returns g² / H of coordinates whose slope leads off their bounds; else 0."""
    away = ((slope < 0.0) & (step < high)) | ((slope > 0.0) & (step > low))
    gain = slope**2 / np.maximum(np.diag(hessian), 1e-300)
    return np.where(away & (gain > LEAST_GAIN), gain, 0.0)


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
