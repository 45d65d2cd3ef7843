"""Candidates: fitted on all data, scored on folds that a fit did not see.

The parameters θ̂_{−g} without fold g come from one Gauss-Newton step at the common
optimum, on all other folds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.search.noise_gain import loudness
from sysid.diagnosis.search.problem import Problem
from sysid.least_squares import Fit, Task, fit_all


@dataclass(frozen=True, eq=False)
class Model:
    """A candidate: the simulation with some effects released.

    Attributes:
        effects: the released effects.
        fit: on all data.
        score: S, the error on held-out folds.
        penalty: its part from the nuisances.
        fold_theta: coordinates without each fold.
        errors: mean squared weighted residual on all data (controller, mechanics); 1
            where noise is all that is left. Held-out folds would not tell: one that
            alone tells a figure is badly predicted without it.
        loudness: what it pays for noise that it calls loud [nat].
    """

    effects: tuple[str, ...]
    fit: Fit
    score: float
    penalty: float
    fold_theta: Float[np.ndarray, "g n"]
    errors: Float[np.ndarray, "2"]
    loudness: float


def gain_nat(worse: Model, better: Model, samples: int) -> float:
    """Returns the gain in error [nat], less what is gained by calling noise loud.

    A spring that both have drifts from fit to fit: that it calls less is no merit.
    """
    quieter = worse.loudness - better.loudness
    if worse.loudness > 0.0 and better.loudness > 0.0:
        quieter = min(quieter, 0.0)
    return error_nat(worse, better, samples) + quieter


def error_nat(worse: Model, better: Model, samples: int) -> float:
    """Returns ½ (S_worse − S_better) / max(1, s²), s² the error per sample left.

    The errors on all data must fall as much: a fold that alone tells a figure is badly
    predicted from its tolerance, and that is not the simulation's fault.
    """
    held, fitted = worse.score - better.score, worse.fit.cost - better.fit.cost
    return 0.5 * min(held, fitted) / max(1.0, better.score / max(samples, 1))


def bent(problem: Problem, model: Model, effect: str) -> float:
    """Returns how far an effect's figures lie from where they are [deviations]."""
    away = [
        abs(model.fit.theta[i] - slot.base) / slot.tight
        for i, slot in enumerate(problem.space.slots)
        if slot.effect == effect and 0.0 < slot.tight < np.inf
    ]
    return max(away, default=0.0)


def fit_models(
    problem: Problem,
    sets: Sequence[tuple[str, ...]],
    starts: Sequence[Float[np.ndarray, " n"]],
    shared: dict | None = None,
    rounds: int = 5,
) -> list[Model]:
    """Fits models from given starts and scores them on held-out folds."""
    tasks = [_task(problem, s, t) for s, t in zip(sets, starts, strict=True)]
    fits = fit_all(problem.residual, tasks, rounds, shared=shared)
    return _scored(problem, sets, tasks, fits)


def _task(problem: Problem, effects: tuple[str, ...], start: np.ndarray) -> Task:
    space = problem.space
    deviation = space.deviations(effects)
    free = np.flatnonzero(deviation > 0.0)
    start = np.where(deviation > 0.0, start, space.base)
    low = np.array([s.low for s in space.slots])
    high = np.array([s.high for s in space.slots])
    wide = np.where(deviation > 0, deviation, 1.0)
    comb = np.array([s.comb for s in space.slots])
    steps = np.where(comb, 3e-4 * np.maximum(np.abs(start), 1e-6), 0.0)
    # A limit that the smaller model does not reach has no slope there.
    fresh = tuple(space.of(effects[-1])) if effects else ()
    return Task(start, free, space.base, wide, low, high, steps, fresh)


def _scored(problem, sets, tasks, fits) -> list[Model]:
    """Predicts every fold from the others."""
    folds, count = problem.folds(), int(problem.fold.max()) + 1
    thetas = np.stack(
        [
            _without(f, t, folds, g, problem.space.local())
            for f, t in zip(fits, tasks, strict=True)
            for g in range(count)
        ]
    )
    squares = problem.residual(thetas) ** 2
    counted = problem.counts().reshape(2, -1).sum(1)
    models = []
    for k, (effects, fit) in enumerate(zip(sets, fits, strict=True)):
        mine = squares[k * count : (k + 1) * count]
        heldout = np.take_along_axis(mine, folds[None], 0)[0].reshape(2, -1)
        score = float(heldout.sum())
        errors = np.sum(fit.residual.reshape(2, -1) ** 2, 1) / np.maximum(counted, 1)
        penalty = _penalty(problem, tasks[k], effects, fit.theta)
        score = score + penalty if np.isfinite(score) else np.inf
        kept = thetas[k * count : (k + 1) * count]
        loud = loudness(problem, fit.theta, float(errors[1]))
        models.append(Model(tuple(effects), fit, score, penalty, kept, errors, loud))
    return models


def _penalty(problem: Problem, task: Task, effects, theta: np.ndarray) -> float:
    """Squared deviations of the figures that should be inside their tolerances."""
    slots = problem.space.slots
    kept = [i for i in task.free if slots[i].effect not in effects]
    return float(np.sum(((theta - task.center)[kept] / task.deviation[kept]) ** 2))


def _without(
    fit: Fit, task: Task, folds: np.ndarray, g: int, local: list[int]
) -> np.ndarray:
    """Returns the coordinates that the data without one fold ask for.

    What belongs to a record and not to the mechanism stays. What the fit has not
    reached yet on all data is not the fold's.
    """
    k = fit.free
    weight = 1.0 / task.deviation[k] ** 2
    steps = []
    for kept in (folds != g, np.ones(len(folds), bool)):
        j, r = fit.jacobian[kept], fit.residual[kept]
        slope = j.T @ r + weight * (fit.theta - task.center)[k]
        steps.append(np.linalg.solve(j.T @ j + np.diag(weight), slope))
    theta = fit.theta.copy()
    theta[k] = np.clip(theta[k] - steps[0] + steps[1], task.low[k], task.high[k])
    theta[local] = fit.theta[local]
    return theta
