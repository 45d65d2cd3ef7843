"""From where the fits of an effect begin."""

from collections.abc import Sequence

import numpy as np

from sysid.diagnose_model import Model
from sysid.diagnose_problem import Problem

COMB = (0.02, 0.002)
"""Logarithms around the best start within which a comb of optima is searched."""


def starts_of(problem: Problem, model: Model, names: Sequence[str]) -> dict[str, list]:
    """Returns the best starts of every effect: near the model, and from the figures.

    A start counts by the error that is left when the nuisances follow it linearly.
    """
    result: dict[str, list] = {name: [] for name in names}
    fitted, nominal = model.fit.theta, problem.space.base.copy()
    kept = [i for e in model.effects for i in problem.space.of(e)]
    nominal[kept] = fitted[kept]
    for origin, count in ((fitted, 2), (nominal, 1)):
        some = names if count == 2 else [n for n in names if not _comb(problem, n)]
        owned = [(n, t) for n in some for t in _tried(problem, model, origin, n)]
        costs = _linear_costs(problem, model, np.stack([t for _, t in owned]))
        for name in some:
            mine = [k for k, (owner, _) in enumerate(owned) if owner == name]
            few = count if len(mine) > 2 else 1
            best = sorted(mine, key=lambda k: costs[k])[:few]
            result[name] += [owned[k][1] for k in best]
    return result


def _tried(problem: Problem, model: Model, origin: np.ndarray, name: str) -> list:
    """Returns the coordinates that are tried for an effect."""
    starts = []
    for start in problem.space.starts(name):
        theta = origin.copy()
        theta[list(start)] = list(start.values())
        starts.append(theta)
    if not _comb(problem, name):
        return starts
    index = problem.space.of(name)[0]
    for spread in COMB:
        costs = _linear_costs(problem, model, np.stack(starts))
        best = starts[int(np.argmin(costs))]
        for factor in np.exp(np.linspace(-spread, spread, 31)):
            theta = best.copy()
            theta[index] *= factor
            starts.append(theta)
    return starts


def _comb(problem: Problem, name: str) -> bool:
    return problem.space.slots[problem.space.of(name)[0]].comb


def _linear_costs(problem: Problem, model: Model, thetas: np.ndarray) -> np.ndarray:
    """Returns the errors that are left when the nuisances follow linearly."""
    rs = problem.residual(thetas)
    fit, space = model.fit, problem.space
    deviation = space.deviations(model.effects)[fit.free]
    j = np.concatenate([fit.jacobian, np.diag(1.0 / deviation)])
    center = (thetas - space.base)[:, fit.free] / deviation
    full = np.concatenate([rs, center], 1)
    q, _ = np.linalg.qr(j)
    cost = np.sum(full**2, 1) - np.sum((full @ q) ** 2, 1)
    return np.where(np.isfinite(cost), cost, np.inf)
