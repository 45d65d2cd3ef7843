"""A smaller model is at least as near as a larger one without its effect.

A fit may end in a valley of its own. If a larger model leaves it, and its effect does
nothing there, the effect would be given what the valley cost.
"""

import numpy as np

from sysid.diagnosis.fits.candidate import CONVERGED, Model, fit_models, task_of
from sysid.diagnosis.fits.problem import Problem

NEARER = 2.0
"""Least cost that goes with a fit from there: a nat, less decides nothing."""


def nearer_without(problem: Problem, smaller: Model, larger: Model) -> Model:
    """Returns the smaller model, fitted again from a larger one if that is nearer.

    It begins at θ̂ of the larger model with what that has beyond at nominal, if there

        ‖r(θ)‖² + Σ_i ((θ_i − θ⁰_i) / σ_i)² < C − `NEARER`

    with the cost C of the smaller model's own fit, and if the models are nested.

    Args:
        problem: to whose residuals both were fitted.
        smaller: the model with fewer effects.
        larger: the one that has them and others.

    Source:
        Ours: nested models, of which the likelihood of the smaller is no larger.
    """
    if not set(smaller.effects) < set(larger.effects):
        return smaller
    theta, space = larger.fit.theta.copy(), problem.space
    for effect in set(larger.effects) - set(smaller.effects):
        own = space.of(effect)
        theta[own] = space.nominal[own]
    task = task_of(problem, smaller.effects, theta)
    cost = np.sum(problem.residual(task.start[None]) ** 2) + task.penalty(task.start)
    if not cost < smaller.fit.cost - NEARER:
        return smaller
    again = fit_models(problem, [smaller.effects], [task.start], rounds=CONVERGED)[0]
    return min(smaller, again, key=lambda m: m.fit.cost)
