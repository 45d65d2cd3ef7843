"""From where fits to the simulated angle begin: what the equations say, and nominal.

In closed loop the error of the angle has many optima: a servo whose stiffness is off
rings at another frequency, and a fit of the angle stays where it began. The equations
have one optimum and are near the truth, but less exact. And where an error is large,
priors count for nothing: what others can take up of it they do, unless the effect is
fitted alone at first.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.search.candidate import (
    Model,
    at_nominal,
    fit_models,
    task_of,
)
from sysid.diagnosis.search.output_error import OutputProblem
from sysid.diagnosis.search.parameters import Space
from sysid.least_squares import fit_all

EQUATIONS_TRIED = 3
"""Number of candidates of a stage that are fitted to the angle as the equations say."""

ALONE_TRIED = 3
"""The same of those that come nearest to it when they are fitted alone, at nominal and
in the smaller model, each."""


def settled_output(
    output: OutputProblem, equations: Model
) -> tuple[OutputProblem, Model]:
    """Fits the nuisance parameters to the angle and estimates the noise, in turns.

    Args:
        output: the error of the angle, of unit noise.
        equations: a model by the equations.

    Returns:
        The problem with its noise, and the model of the same effects.
    """
    effects = equations.effects
    fitted = equations.fit.theta
    loose = np.array([np.isinf(slot.prior_sd) for slot in output.space.slots])
    begin = at_nominal(output, equations)
    starts = np.stack([begin, np.where(loose, fitted, begin), fitted])
    raw = output.raw(starts, weigh=False)
    nearest = raw[np.argmin(np.sum(raw**2, (1, 2, 3)))]
    problem = output.with_noise(nearest)
    models = fit_models(problem, [effects] * len(starts), list(starts), rounds=10)
    theta = min(models, key=lambda m: m.fit.cost).fit.theta
    problem = output.with_noise(output.raw(theta[None], weigh=False)[0])
    return problem, fit_models(problem, [effects], [theta])[0]


def output_starts(
    problem: OutputProblem, smaller: Model, proposed: list[Model]
) -> list[tuple[tuple[str, ...], Float[np.ndarray, " n"]]]:
    """Returns where fits of the likeliest models begin: from two places each.

    One is near: the effect as the equations have it, with nuisance parameters as in
    the smaller model or as in the equations, whichever errs less. The other begins at
    nominal, with the effect fitted alone: without an effort all torques together may
    grow, and in that valley the near one may have gone far. Those are chosen that come
    nearest if they are fitted alone there, those that do in the smaller model, and some
    that the equations prefer. Where a nominal parameter of the smaller model stands for
    an effect, as the servo's damping for viscous friction, all effects come alike near
    there; at nominal they do not.

    Args:
        problem: the error of the angle.
        smaller: the model that lacks an effect, fitted to the angle.
        proposed: models of the equations, each with one effect more, best first.
    """
    sets, space = [m.effects for m in proposed], problem.space
    beside = [_beside(space, smaller, m) for m in proposed]
    fitted = [m.fit.theta for m in proposed]
    closer = _costs(problem, sets, beside) <= _costs(problem, sets, fitted)
    near = np.where(closer[:, None], beside, fitted)
    begin = [at_nominal(problem, m) for m in proposed]
    fits = _fitted_alone(problem, [*sets, *sets], [*begin, *beside])
    alone, added = fits[: len(sets)], fits[len(sets) :]
    chosen = dict.fromkeys(range(min(EQUATIONS_TRIED, len(sets))))
    for thetas in (alone, added):
        ranked = np.argsort(_costs(problem, sets, thetas))
        chosen |= dict.fromkeys(ranked[:ALONE_TRIED].tolist())
    return [(sets[k], start) for k in chosen for start in (near[k], alone[k])]


def _costs(
    problem: OutputProblem,
    sets: Sequence[tuple[str, ...]],
    thetas: Sequence[Float[np.ndarray, " n"]],
) -> Float[np.ndarray, " s"]:
    """Returns squared errors and penalties of the priors, for every set."""
    errors = np.sum(problem.residual(np.stack(thetas)) ** 2, 1)
    pairs = zip(sets, thetas, strict=True)
    return errors + np.array([_penalty(problem.space, *pair) for pair in pairs])


def _fitted_alone(
    problem: OutputProblem,
    sets: Sequence[tuple[str, ...]],
    starts: Sequence[Float[np.ndarray, " n"]],
) -> list[Float[np.ndarray, " n"]]:
    """Fits the last effect of each model; all else stays where it begins."""
    tasks = [
        replace(
            task_of(problem, effects, start),
            start=start,
            free=np.array(problem.space.of(effects[-1])),
        )
        for effects, start in zip(sets, starts, strict=True)
    ]
    return [fit.theta for fit in fit_all(problem.residual, tasks, 5)]


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
