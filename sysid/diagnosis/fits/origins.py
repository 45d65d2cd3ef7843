"""Places where fits begin anew: a model's effects, and all else as it is known."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.candidate import CONVERGED, Model, fit_models
from sysid.diagnosis.fits.problem import Problem


def at_nominal(problem: Problem, model: Model) -> Float[np.ndarray, " n"]:
    """Coordinates of a fit with its nuisance parameters at their nominal values.

    θ_i = θ̂_i for the parameters of the model's effects, else θ⁰_i.

    Args:
        problem: residuals of a joint.
        model: a fitted model.

    Returns:
        Coordinates, in units of their scales [1].

    Source:
        Ours: starts from which nuisance parameters cannot compensate each other.
    """
    return with_effects(problem, problem.space.nominal, model, model.effects)


def near_nominal(problem: Problem, model: Model) -> Float[np.ndarray, " n"]:
    """As `at_nominal`, but what is declared free stays as it was fitted.

    It has no nominal value: at any other, all that is at its own is compared by what a
    wrong gain does, and from there a fit moves masses before it finds the gain.

    Args:
        problem: residuals of a joint.
        model: a fitted model.

    Returns:
        Coordinates, in units of their scales [1].

    Source:
        Ours.
    """
    return np.where(_free(problem), model.fit.theta, at_nominal(problem, model))


def begun_anew(problem: Problem, model: Model) -> Model:
    """Fits again from `near_nominal`, where something is free; returns the better.

    On the way from a wrong gain to the right one times and masses move for it, and may
    stay where they went.

    Args:
        problem: residuals of a joint.
        model: a fitted model.
    """
    if not _free(problem).any():
        return model
    start = near_nominal(problem, model)
    again = fit_models(problem, [model.effects], [start], rounds=CONVERGED)[0]
    return min(model, again, key=lambda m: m.fit.cost)


def put_back(problem: Problem, model: Model, most_sd: float) -> Float[np.ndarray, " n"]:
    """Coordinates of a fit with what is far off its prior at its nominal value.

    θ_i = θ⁰_i where |θ̂_i − θ⁰_i| > s σ_i, of no effect of the model, else θ̂_i.

    Args:
        problem: residuals of a joint.
        model: a fitted model.
        most_sd: s, prior standard deviations that stay [1].

    Returns:
        Coordinates, in units of their scales [1].

    Source:
        Ours: a parameter that leaves its tolerance may stand for an effect.
    """
    theta = model.fit.theta.copy()
    for i, slot in enumerate(problem.space.slots):
        known = 0.0 < slot.prior_sd < np.inf and slot.effect not in model.effects
        if known and slot.shift(theta[i]) > most_sd:
            theta[i] = slot.nominal
    return theta


def _free(problem: Problem) -> np.ndarray:
    """Which parameters have no nominal value."""
    return np.isinf([slot.prior_sd for slot in problem.space.slots])


def with_effects(
    problem: Problem,
    origin: Float[np.ndarray, " n"],
    model: Model,
    effects: Sequence[str],
) -> Float[np.ndarray, " n"]:
    """Coordinates of an origin, with effects of a model as that was fitted.

    θ_i = θ̂_i for the parameters of the effects, else those of the origin.

    Args:
        problem: residuals of a joint.
        origin: coordinates, in units of their scales [1].
        model: a fitted model.
        effects: those of the model that are put there.

    Source:
        Ours.
    """
    theta = origin.copy()
    kept = [i for e in effects for i in problem.space.of(e)]
    theta[kept] = model.fit.theta[kept]
    return theta
