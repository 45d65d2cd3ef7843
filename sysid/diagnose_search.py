"""Which effects does the simulation lack? Fits, held-out scores, forward and backward.

Every effect of the catalogue is fitted, from several starts, beside the nuisances. What
counts is the error on folds that the fit did not see:

    S(M) = Σ_g ‖W r_g(θ̂_{−g})‖² + Σ_i ((θ_i − θ⁰_i) / σ_i)²

with the second sum over the nuisances that stay inside their tolerances σ_i, so that a
figure far out of its tolerance is a finding and not silently absorbed.

The parameters θ̂_{−g} without fold g come from one Gauss-Newton step at the common
optimum, on all other folds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sysid.diagnose_problem import Problem
from sysid.fit import Fit, Task, fit_all

MOST = 3
"""Largest number of causes."""

REFINED = 4
"""Number of candidates whose fits are continued."""

LEAST_SHARE = 0.03
"""Least share of the held-out error that a cause must remove."""

OUT_OF_TOLERANCE = 16.0
"""Squared deviations at which a figure counts as out of its tolerance: four sigma."""

ALIKE = 0.015
"""Share of a gain that does not decide between two effects."""

THRESHOLD = 12.0
"""Least gain of a cause in the logarithm of the predictive density [nat]."""

FIGURE_THRESHOLD = 6.0
"""The same of a figure that the simulation has and that leaves its tolerance [nat]."""


@dataclass(frozen=True, eq=False)
class Model:
    """A candidate: the simulation with some effects released.

    Attributes:
        effects: the released effects.
        fit: on all data.
        score: S, the error on held-out folds.
        penalty: its part from the nuisances.
        fold_theta: coordinates without each fold.
    """

    effects: tuple[str, ...]
    fit: Fit
    score: float
    penalty: float
    fold_theta: Float[np.ndarray, "g n"]


@dataclass(frozen=True, eq=False)
class Search:
    """What a search found.

    Attributes:
        problem: with the final noise.
        base: the simulation with its nuisances fitted.
        best: the model that is chosen.
        rivals: for each cause, models in which another effect takes its place, best
            first.
        without: for each cause, the model without it.
        samples: number of residuals that count.
    """

    problem: Problem
    base: Model
    best: Model
    rivals: dict[str, list[Model]]
    without: dict[str, Model]
    samples: int

    def gain(self, worse: Model, better: Model) -> float:
        """Gain in log predictive density [nat], at the error that remains."""
        return gain_nat(worse, better, self.samples)


def gain_nat(worse: Model, better: Model, samples: int) -> float:
    """Returns ½ (S_worse − S_better) / max(1, s²), s² the error per sample left.

    The errors on all data must fall as much: a fold that alone tells a figure is badly
    predicted from its tolerance, and that is not the simulation's fault.
    """
    held, fitted = worse.score - better.score, worse.fit.cost - better.fit.cost
    return 0.5 * min(held, fitted) / max(1.0, better.score / max(samples, 1))


def search(problem: Problem) -> Search:
    """Runs the whole search on one joint.

    Without repeats it runs again with what the first result leaves as noise.
    """
    problem, base = _settled(problem)
    found = _searched(problem, base)
    if problem.repeat or not found.best.effects:
        return found
    left = problem.raw(found.best.fit.theta[None], weigh=False)[0]
    problem = problem.with_noise(left)
    base = fit_models(problem, [()], [base.fit.theta])[0]
    return _searched(problem, base)


def _searched(problem: Problem, base: Model) -> Search:
    """Searches at a given noise."""
    samples = int(problem.counts().sum())
    best = base
    rivals: dict[str, list[Model]] = {}
    for _ in range(MOST):
        stage = _extended(problem, best)
        if not stage:
            break
        winner = stage[0]
        if not _worth(problem, best, winner, samples):
            break
        again = fit_models(problem, [best.effects], [winner.fit.theta])[0]
        if again.fit.cost < best.fit.cost:
            base = again if not best.effects else base
            if not _worth(problem, again, winner, samples):
                best = again
                break
        best = _pruned(problem, winner, samples)
        if best.effects != winner.effects:
            break
        if len(best.effects) == 1:
            rivals[best.effects[0]] = stage[1:]
    without = {best.effects[0]: base} if best.effects else {}
    if len(best.effects) > 1:
        rivals, without = _swapped(problem, best)
    return Search(problem, base, best, rivals, without, samples)


def _worth(problem: Problem, smaller: Model, larger: Model, samples: int) -> bool:
    """Tells whether a larger model is worth its effect."""
    gain = gain_nat(smaller, larger, samples)
    added = [e for e in larger.effects if e not in smaller.effects]
    if all(problem.space.figured(e) for e in added):
        return gain > FIGURE_THRESHOLD
    share = 1.0 - larger.score / smaller.score
    told = smaller.penalty - larger.penalty > OUT_OF_TOLERANCE
    return gain > THRESHOLD and (share > LEAST_SHARE or told)


def _settled(problem: Problem) -> tuple[Problem, Model]:
    """Fits the nuisances and estimates the noise, twice."""
    theta = problem.space.base
    for _ in range(3):
        problem = problem.with_noise(problem.raw(theta[None], weigh=False)[0])
        model = fit_models(problem, [()], [theta])[0]
        theta = model.fit.theta
    return problem, model


def _extended(problem: Problem, model: Model) -> list[Model]:
    """Adds every effect that a model lacks, best first."""
    names = [e for e in problem.space.effects if e not in model.effects]
    sets = [(*model.effects, name) for name in names]
    starts = _starts(problem, model, names)
    jobs = [(s, t) for s, name in zip(sets, names, strict=True) for t in starts[name]]
    shared = dict(zip(model.fit.free.tolist(), model.fit.jacobian.T, strict=True))
    models = fit_models(problem, [j[0] for j in jobs], [j[1] for j in jobs], shared)
    best: dict[tuple, Model] = {}
    for m in models:
        if m.effects not in best or m.fit.cost < best[m.effects].fit.cost:
            best[m.effects] = m
    stage = _refined(problem, model, list(best.values()))
    return _simplest_first(problem, model, stage)


def _refined(problem: Problem, smaller: Model, stage: list[Model]) -> list[Model]:
    """Goes on with the fits that are nearest to the records; best first."""
    samples = int(problem.counts().sum())

    def order(m: Model) -> float:
        return -gain_nat(smaller, m, samples)

    near = sorted(stage, key=lambda m: m.fit.cost)[:REFINED]
    near += [m for m in sorted(stage, key=order)[:REFINED] if m not in near]
    sets, starts = [m.effects for m in near], [m.fit.theta for m in near]
    again = {m.effects: m for m in fit_models(problem, sets, starts, rounds=14)}
    return sorted((again.get(m.effects, m) for m in stage), key=order)


def _simplest_first(
    problem: Problem, smaller: Model, stage: list[Model]
) -> list[Model]:
    """Puts the effect with the fewest parameters first among those that tie."""
    if not stage:
        return stage
    samples = int(problem.counts().sum())
    gains = {m.effects: gain_nat(smaller, m, samples) for m in stage}
    most = gains[stage[0].effects]
    tied = [m for m in stage if most - gains[m.effects] < max(3.0, ALIKE * most)]
    first = min(
        tied, key=lambda m: (len(problem.space.of(m.effects[-1])), -gains[m.effects])
    )
    return [first, *(m for m in stage if m is not first)]


def _starts(problem: Problem, model: Model, names: Sequence[str]) -> dict[str, list]:
    """Returns the two best starts of every effect.

    A start counts by the error that is left when the nuisances follow it linearly.
    """
    thetas, owners = [], []
    for name in names:
        for start in problem.space.starts(name):
            theta = model.fit.theta.copy()
            theta[list(start)] = list(start.values())
            thetas.append(theta)
            owners.append(name)
    rs = problem.residual(np.stack(thetas))
    fit, space = model.fit, problem.space
    deviation = space.deviations(model.effects)[fit.free]
    j = np.concatenate([fit.jacobian, np.diag(1.0 / deviation)])
    center = ((fit.theta - space.base)[fit.free]) / deviation
    full = np.concatenate([rs, np.tile(center, (len(rs), 1))], 1)
    q, _ = np.linalg.qr(j)
    cost = np.sum(full**2, 1) - np.sum((full @ q) ** 2, 1)
    cost = np.where(np.isfinite(cost), cost, np.inf)
    result: dict[str, list] = {name: [] for name in names}
    for k in np.argsort(cost):
        if len(result[owners[k]]) < (2 if len(space.starts(owners[k])) > 2 else 1):
            result[owners[k]].append(thetas[k])
    return result


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
    return Task(
        start, free, space.base, np.where(deviation > 0, deviation, 1.0), low, high
    )


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
    models = []
    for k, (effects, fit) in enumerate(zip(sets, fits, strict=True)):
        mine = squares[k * count : (k + 1) * count]
        score = sum(float(mine[g][folds == g].sum()) for g in range(count))
        penalty = _penalty(problem, tasks[k], effects, fit.theta)
        score = score + penalty if np.isfinite(score) else np.inf
        kept = thetas[k * count : (k + 1) * count]
        models.append(Model(tuple(effects), fit, score, penalty, kept))
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


def _pruned(problem: Problem, model: Model, samples: int) -> Model:
    """Drops effects that a larger model no longer needs."""
    while len(model.effects) > 1:
        sets = [tuple(e for e in model.effects if e != out) for out in model.effects]
        smaller = fit_models(problem, sets, [model.fit.theta] * len(sets))
        best = min(smaller, key=lambda m: m.score)
        if _worth(problem, best, model, samples):
            return model
        model = best
    return model


def _swapped(
    problem: Problem, best: Model
) -> tuple[dict[str, list[Model]], dict[str, Model]]:
    """Lets every other effect take the place of each cause, and none."""
    rivals, without = {}, {}
    for cause in best.effects:
        rest = tuple(e for e in best.effects if e != cause)
        without[cause] = fit_models(problem, [rest], [best.fit.theta])[0]
        stage = _extended(problem, without[cause])
        rivals[cause] = [m for m in stage if cause not in m.effects]
    return rivals, without
