"""What is left of an error when the nuisance parameters follow linearly."""

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.problem import Problem


def linear_costs(
    problem: Problem, model: Model, thetas: Float[np.ndarray, "c n"]
) -> Float[np.ndarray, " c"]:
    """What remains when the nuisance parameters follow linearly: ‖(I − Q Qᵀ) r(θ)‖².

    Args:
        problem: residuals of a joint.
        model: whose nuisance parameters follow.
        thetas: coordinates θ [1].

    Source:
        As `unexplained_by`.
    """
    cost = np.sum(unexplained_by(problem, model, thetas) ** 2, 1)
    return np.where(np.isfinite(cost), cost, np.inf)


def unexplained_by(
    problem: Problem, model: Model, thetas: Float[np.ndarray, "c n"]
) -> Float[np.ndarray, "c r"]:
    """Residuals without what nuisance parameters explain linearly: (I − Q Qᵀ) r(θ).

    Args:
        problem: residuals of a joint.
        model: whose Jacobian J = Q R, with that of the priors, they follow.
        thetas: coordinates θ [1].

    Returns:
        Whitened residuals and the distances from the priors behind them [1].

    Source:
        Variable projection: G. H. Golub, V. Pereyra, The Differentiation of
        Pseudo-Inverses and Nonlinear Least Squares Problems Whose Variables Separate,
        SIAM Journal on Numerical Analysis 10(2), 1973; at slopes of one place.
    """
    rs = problem.residual(thetas)
    fit, space = model.fit, problem.space
    prior_sd = space.prior_sds(model.effects)[fit.free]
    j = np.concatenate([fit.jacobian, np.diag(1.0 / prior_sd)])
    center = (thetas - space.nominal)[:, fit.free] / prior_sd
    full = np.concatenate([rs, center], 1)
    q, _ = np.linalg.qr(j)
    return full - (full @ q) @ q.T
