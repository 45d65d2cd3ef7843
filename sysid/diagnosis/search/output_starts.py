"""From where fits to the simulated angle begin: what the equations say, and nominal.

In closed loop the error of the angle has many optima: a servo whose stiffness is off
rings at another frequency, and a fit of the angle stays where it began. The equations
have one optimum and are near the truth, but less exact.
"""

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.search.candidate import Model, at_nominal, fit_models
from sysid.diagnosis.search.output_error import OutputProblem
from sysid.diagnosis.search.parameters import Space


def settled_output(
    output: OutputProblem, equations: Model
) -> tuple[OutputProblem, Model]:
    """Fits the nuisance parameters to the angle and estimates the noise, in turns.

    Args:
        output: the error of the angle, of unit noise.
        equations: the nominal model by the equations.
    """
    nominal, fitted = output.space.nominal, equations.fit.theta
    loose = np.array([np.isinf(slot.prior_sd) for slot in output.space.slots])
    starts = np.stack([nominal, np.where(loose, fitted, nominal), fitted])
    raw = output.raw(starts, weigh=False)
    nearest = raw[np.argmin(np.sum(raw**2, (1, 2, 3)))]
    problem = output.with_noise(nearest)
    models = fit_models(problem, [()] * len(starts), list(starts), rounds=10)
    theta = min(models, key=lambda m: m.fit.cost).fit.theta
    problem = output.with_noise(output.raw(theta[None], weigh=False)[0])
    return problem, fit_models(problem, [()], [theta])[0]


def output_starts(
    problem: OutputProblem, smaller: Model, proposed: list[Model]
) -> list[Float[np.ndarray, " n"]]:
    """Returns for each model of the equations the start that errs least.

    The effect is as the equations have it; nuisance parameters are at nominal, as in
    the smaller model, or as in the equations: without an effort all torques together
    may grow, and in that valley the equations may have gone far.

    Args:
        problem: the error of the angle.
        smaller: the model that lacks an effect, fitted to the angle.
        proposed: models of the equations, each with one effect more.
    """
    options = [
        theta
        for m in proposed
        for theta in (
            at_nominal(problem, m),
            _beside(problem.space, smaller, m),
            m.fit.theta,
        )
    ]
    errors = np.sum(problem.residual(np.stack(options)) ** 2, 1)
    sets = [m.effects for m in proposed for _ in range(3)]
    each = zip(sets, options, errors, strict=True)
    costs = [e + _penalty(problem.space, s, theta) for s, theta, e in each]
    best = np.argmin(np.reshape(costs, (-1, 3)), 1)
    return [options[3 * k + int(i)] for k, i in enumerate(best)]


def _beside(space: Space, smaller: Model, larger: Model) -> Float[np.ndarray, " n"]:
    """Returns the smaller model with the larger one's last effect."""
    theta = smaller.fit.theta.copy()
    own = space.of(larger.effects[-1])
    theta[own] = larger.fit.theta[own]
    return theta


def _penalty(space: Space, effects: tuple[str, ...], theta: np.ndarray) -> float:
    """Returns Σ ((θ − θ⁰) / σ)² over the nuisance parameters."""
    sds = space.prior_sds(effects)
    kept = np.isfinite(sds) & (sds > 0.0)
    kept[[i for e in effects for i in space.of(e)]] = False
    return float(np.sum(((theta - space.nominal)[kept] / sds[kept]) ** 2))
